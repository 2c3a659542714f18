#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/atomic_file.hpp"
#include "base/clock.hpp"
#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "commands/map_options.hpp"
#include "commands/sampling_options.hpp"
#include "commands/validators.hpp"
#include "picture/light_list.hpp"
#include "sampling/sample_records.hpp"
#include "sampling/stage3_sample.hpp"
#include "shading/display.hpp"

namespace clerestory::commands {
namespace {

struct SampleOptions {
    Common common;
    MapOptions map;
    ToneOptions tone;
    DrawOptions draw{.counts = {64, 256, 1024}};
    std::vector<std::string> lights;  ///< formats of the light list; none: no list
    std::string folder = ".";
};

/// Everything that decides a set of samples.
nlohmann::json describe_samples(const SampleOptions& options, const Scene& scene) {
    return {{"map", describe_map(options.map, scene.map())},
            {"seed", options.common.seed},
            {"sequence", options.draw.sequence},
            {"texel", options.draw.texel},
            {"table_arithmetic", options.draw.table_arithmetic}};
}

/// The samples as lights for other renderers, in each format asked for; returns the files' names by format.
nlohmann::json write_lights(const SampleOptions& options, const Scene& scene, const std::filesystem::path& stem,
                            const std::vector<SampleRecord>& records) {
    nlohmann::json files = nlohmann::json::object();
    if (options.lights.empty()) return files;
    const auto lights = light_list(records, options.map.scale);
    nlohmann::json facts = describe_samples(options, scene);
    facts.update(facts["map"]);  // EXR attributes are named as those of pictures
    facts.erase("map");
    for (const std::string& format : options.lights) {
        const std::string file = stem.string() + "." + format;
        if (format == "json") {
            write_text(file, lights_json(lights, facts));
        } else {
            write_lights_exr(file, lights, facts);
        }
        files[format] = file;
        say(options.common, fmt::format("{}: {} lights", file, lights.size()));
    }
    return files;
}

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
    const auto lights = std::filesystem::path(options.folder) / fmt::format("lights_{}", count);
    return {{"samples", count},
            {"csv", csv},
            {"png", png},
            {"lights", write_lights(options, scene, lights, records)},
            {"seconds", seconds}};
}

/// Refuses files that would be harmed, before any work.
void check_files_of_sets(const SampleOptions& options) {
    std::vector<std::filesystem::path> files;
    for (const std::size_t count : options.draw.counts) {
        const std::filesystem::path folder(options.folder);
        for (const char* suffix : {"csv", "png"}) files.push_back(folder / fmt::format("samples_{}.{}", count, suffix));
        for (const auto& suffix : options.lights) files.push_back(folder / fmt::format("lights_{}.{}", count, suffix));
    }
    check_files(options.common, {map_file(options.map)}, std::move(files));
}

void run(const SampleOptions& options) {
    check_files_of_sets(options);
    SceneLoader loader =
        load_scene(options.map, options.common, table_arithmetic_by_name(options.draw.table_arithmetic));
    const Device device = open_device(options.common);
    TableBuilder builder(device);
    const auto scene = finish_scene(loader, device, builder, options.map, options.common);
    Sampler sampler(device, scene->device_map(), scene->distribution(),
                    sampling_of(options.draw, options.common, options.map.rotate_y));
    Display display(device);
    nlohmann::json report = describe_samples(options, *scene);
    report["device"] = device.info().name;
    report["sets"] = nlohmann::json::array();
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
    command
        ->add_option("--lights", options->lights,
                     "Write each set also as lights_N, directional lights for other renderers: json, exr or both")
        ->delimiter(',')
        ->type_name("FORMAT[,...]")
        ->check(one_of({"json", "exr"}));
    command->add_option("-o,--output", options->folder, "Folder for samples_N.png and samples_N.csv")
        ->check(output_name())
        ->type_name("DIR")
        ->capture_default_str();
    add_common(*command, options->common,
               "  clerestory sample studio.exr -n 64,256,1024 -o marks\n"
               "  clerestory sample studio.exr -n 256 --lights json,exr -o lights");
    command->callback([options] { run(*options); });
}

}  // namespace clerestory::commands
