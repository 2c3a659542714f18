#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "atomic_file.hpp"
#include "clock.hpp"
#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "commands/map_options.hpp"
#include "commands/sampling_options.hpp"
#include "sample_report.hpp"

namespace clerestory::commands {
namespace {

struct SampleOptions {
    Common common;
    MapOptions map;
    ToneOptions tone;
    DrawOptions draw{.counts = {64, 256, 1024}};
    std::string folder = ".";
};

nlohmann::json write_set(const SampleOptions& options, const Scene& scene, Sampler& sampler, Display& display,
                         std::size_t count) {
    const std::filesystem::path stem = std::filesystem::path(options.folder) / fmt::format("samples_{}", count);
    const std::string csv = stem.string() + ".csv";
    const std::string png = stem.string() + ".png";
    const Stopwatch watch;
    const SampleSet set = sampler.draw(count);
    const auto records = sample_records(set, scene.distribution());
    const double seconds = watch.seconds();
    write_text(csv, samples_csv(records));
    const auto preview = display.marked_preview(scene.map(), options.map.scale, options.tone, set.texel);
    write_png(png, scene.map().width, scene.map().height, 4, reinterpret_cast<const unsigned char*>(preview.data()));
    say(options.common, fmt::format("{}: {} samples marked; {}", png, count, csv));
    return {{"samples", count}, {"csv", csv}, {"png", png}, {"seconds", seconds}};
}

void run(const SampleOptions& options) {
    const Device device(options.common.device);
    TableBuilder builder(device);
    const auto scene = make_scene(device, builder, read_map_of(options.map), options.map, options.common);
    Sampler sampler(device, scene->device_map(), scene->distribution(),
                    sampling_of(options.draw, options.common, options.map.rotate_y));
    Display display(device);
    nlohmann::json report = {{"map", describe_map(options.map, scene->map())},
                             {"device", device.info().name},
                             {"seed", options.common.seed},
                             {"sequence", options.draw.sequence},
                             {"texel", options.draw.texel},
                             {"sets", nlohmann::json::array()}};
    for (const std::size_t count : options.draw.counts) {
        report["sets"].push_back(write_set(options, *scene, sampler, display, count));
    }
    emit_json(options.common, report);
}

}  // namespace

void add_sample(CLI::App& app) {
    auto* command = app.add_subcommand("sample", "Draw samples of a map and mark them on it");
    auto options = std::make_shared<SampleOptions>();
    add_map_options(*command, options->map);
    add_draw_options(*command, options->draw);
    add_tone_options(*command, options->tone);
    command->add_option("-o,--output", options->folder, "Folder for samples_N.png and samples_N.csv")
        ->type_name("DIR")
        ->capture_default_str();
    add_common(*command, options->common, "  clerestory sample studio.exr -n 64,256,1024 -o marks");
    command->callback([options] { run(*options); });
}

}  // namespace clerestory::commands
