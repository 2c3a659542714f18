#include "sheet/sheet.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "base/clock.hpp"
#include "base/text_escape.hpp"
#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "commands/map_options.hpp"
#include "commands/sampling_options.hpp"
#include "commands/validators.hpp"
#include "error.hpp"

namespace clerestory::commands {
namespace {

struct SheetCommand {
    Common common;
    MapOptions map;
    DrawOptions draw{.counts = {64, 256, 1024}};
    SheetOptions sheet;
    std::string estimator = "shared";
    std::string file = "sheet.png";
};

void run(const SheetCommand& command) {
    if (suffix_of(command.file) != ".png") {
        throw UsageError(fmt::format("{}: a contact sheet ends in .png", command.file));
    }
    check_files(command.common, {map_file(command.map)}, {command.file});
    const Stopwatch total;
    SceneLoader loader = load_scene(command.map, command.common);
    const Device device = open_device(command.common);
    TableBuilder builder(device);
    const auto scene = finish_scene(loader, device, builder, command.map, command.common);
    SheetOptions options = command.sheet;
    options.counts = command.draw.counts;
    if (options.title.empty()) options.title = map_file(command.map).filename().string();
    options.render.estimator = estimator_by_name(command.estimator);
    options.render.scale = command.map.scale;
    const unsigned control_degree = options.render.sampling.control_degree;
    options.render.sampling = sampling_of(command.draw, command.common, command.map.rotate_y);
    options.render.sampling.control_degree = control_degree;
    Progress progress(command.common, "sheet");
    const Sheet sheet =
        make_sheet(device, *scene, options, [&](double done, double whole) { progress.update(done, whole); });
    write_png(command.file, sheet.canvas.width(), sheet.canvas.height(), 3, sheet.canvas.rgb().data());
    say(command.common, command.file);
    nlohmann::json report = sheet.report;
    report["map"] = describe_map(command.map, scene->map());
    report["estimator"] = command.estimator;
    report["sequence"] = command.draw.sequence;
    report["control_degree"] = control_degree;
    report["seed"] = command.common.seed;
    report["device"] = device.info().name;
    report["output"] = command.file;
    report["seconds"] = total.seconds();
    emit_json(command.common, report);
}

}  // namespace

void add_sheet(CLI::App& app) {
    constexpr std::size_t SMALLEST_PANEL = 128;
    constexpr std::size_t LARGEST_PANEL = 2048;
    auto* command = app.add_subcommand(
        "sheet", "Put map, samples, spheres and their errors side by side in one picture, a row a number of samples");
    auto options = std::make_shared<SheetCommand>();
    add_map_options(*command, options->map);
    add_draw_options(*command, options->draw);
    add_control_degree(*command, options->sheet.render.sampling.control_degree);
    command->add_option("--estimator", options->estimator, "How light is added up")
        ->check(one_of({"shared", "per-pixel"}))
        ->capture_default_str();
    command->add_option("--title", options->sheet.title, "Title of the sheet; without it the map's file name")
        ->type_name("TEXT");
    command->add_option("--panel", options->sheet.panel, "Pixels of a sphere's side; a map is up to twice as wide")
        ->transform(whole_number(SMALLEST_PANEL, LARGEST_PANEL))
        ->capture_default_str();
    add_chosen_tone(*command, options->sheet.exposure, options->sheet.gamma);
    command->add_option("-o,--output", options->file, "The sheet, .png")
        ->check(output_name())
        ->type_name("FILE")
        ->capture_default_str();
    add_common(*command, options->common,
               "  clerestory sheet studio.exr -n 64,256,1024 -o sheet.png\n"
               "  clerestory sheet studio.exr -n 8,32 --estimator per-pixel --control-degree 0 -o noise.png");
    command->callback([options] { run(*options); });
}

}  // namespace clerestory::commands
