#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/atomic_file.hpp"
#include "base/clock.hpp"
#include "base/durable.hpp"
#include "base/json_text.hpp"
#include "base/text_escape.hpp"
#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "commands/map_options.hpp"
#include "commands/validators.hpp"
#include "draw/plot.hpp"
#include "error.hpp"
#include "measure/error_meter.hpp"
#include "render/renderer.hpp"
#include "study/measure.hpp"
#include "study/report.hpp"

namespace clerestory::commands {
namespace {

// Kept of the budget for plots, the page and the tables' arithmetic.
constexpr double SECONDS_FOR_REPORT = 6;
constexpr double LARGEST_SHARE_FOR_REPORT = 0.3;

struct StudyCommand {
    Common common;
    MapOptions map;
    std::size_t size = 511;
    std::size_t seeds = 16;
    double budget = 100;
    std::string folder = "study";
};

std::string command_line(const StudyCommand& command) {
    std::string line = "clerestory study";
    if (!command.map.file.empty()) line += " " + shell_path(command.map.file);
    for (const std::string& word : reading_flags(command.map)) line += " " + shell_word(word);
    if (command.map.rotate_y != 0) line += fmt::format(" --rotate-y {}", command.map.rotate_y);
    return line + " -o " + shell_path(command.folder);
}

nlohmann::json provenance(const StudyCommand& command, const Scene& scene, const Device& device) {
    const auto now = std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
    auto map = describe_map(command.map, scene.map());
    map["name"] = map_file(command.map).filename().string();
    map["phi"] = scene.distribution().phi;
    return {{"program", "clerestory"},
            {"version", CLERESTORY_VERSION},
            {"created", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now))},
            {"command", command_line(command)},
            {"device", device.info().name},
            {"platform", device.info().version},
            {"compute_units", device.info().compute_units},
            {"map", map},
            {"table_seconds", scene.build_seconds()}};
}

/// Writes everything: first what others are made of, last the page.
void write_all(const StudyCommand& command, const nlohmann::json& report, const StudyMeasurements& measured,
               const std::map<std::string, std::string>& pictures) {
    const std::filesystem::path folder(command.folder);
    const auto write = [&](const std::string& name, const std::string& text) {
        write_text(folder / name, text);
        say(command.common, (folder / name).string());
    };
    write("study.csv", study_csv(measured.points));
    for (const auto& [name, svg] : pictures) write(name + ".svg", svg);
    sync_remembered();  // the report says that the pictures are there
    write("study.json", json_text(report));
    write("index.html", study_page(report, pictures));
}

void run(const StudyCommand& command) {
    std::vector<std::filesystem::path> files;
    for (const auto& name : study_files()) files.push_back(std::filesystem::path(command.folder) / name);
    check_files(command.common, {map_file(command.map)}, std::move(files));
    const Stopwatch total;
    SceneLoader loader = load_scene(command.map, command.common);
    const Device device = open_device(command.common);
    TableBuilder builder(device);
    const auto scene = finish_scene(loader, device, builder, command.map, command.common);
    if (scene->distribution().black()) {
        throw InputError(fmt::format("{}: the map is black, so that there is no relative error to study",
                                     map_file(command.map).string()));
    }
    StudyOptions options;
    options.base.size = command.size;
    options.base.sampling.seed = command.common.seed;
    options.base.sampling.rotate_y_deg = command.map.rotate_y;
    options.seeds = command.seeds;
    StudyMeasurements measured;
    Renderer renderer(device);
    ErrorMeter meter(renderer, *scene);
    std::map<std::string, std::string> pictures;
    {
        Progress progress(command.common, "study");
        std::vector<StudyTable> tables = measure_tables(device, *scene, luminance_of(command.map));
        const double kept = std::min(SECONDS_FOR_REPORT, LARGEST_SHARE_FOR_REPORT * command.budget);
        options.budget_seconds = std::max(0.0, command.budget - kept - total.seconds());
        measured = measure_study(meter, options, [&](double done, double whole) { progress.update(done, whole); });
        measured.tables = std::move(tables);
    }
    mark_front(measured.points);
    for (const auto& plot : study_plots(measured)) pictures[plot.name] = plot::svg(plot);
    pictures[ERROR_MAPS] = error_maps(meter, options.base);

    nlohmann::json report = provenance(command, *scene, device);
    report.update(study_json(options, measured));
    report["budget_seconds"] = command.budget;
    report["seconds"] = total.seconds();
    write_all(command, report, measured, pictures);
    if (command.common.json != "-") {
        for (const auto& word : report["words"]) fmt::print("{}\n", word["sentence"].get<std::string>());
    }
    if (!measured.left_out.empty()) {
        warn(command.common,
             fmt::format("the budget of {} s left out {} of {} points: see left_out in study.json", command.budget,
                         measured.left_out.size(), measured.left_out.size() + measured.points.size()));
    }
    emit_json(command.common, report);
}

}  // namespace

void add_study(CLI::App& app) {
    constexpr std::size_t SMALLEST_SIDE = 16;
    constexpr std::size_t LARGEST_SIDE = 4096;
    constexpr std::size_t MOST_SEEDS = 1000;
    constexpr double LONGEST_SECONDS = 1e6;
    auto* command = app.add_subcommand(
        "study", "Measure error and time of every way to light a sphere with a map, and rank them on one page");
    auto options = std::make_shared<StudyCommand>();
    add_map_options(*command, options->map);
    command->add_option("--size", options->size, "Pixels of a sphere picture's side")
        ->transform(whole_number(SMALLEST_SIDE, LARGEST_SIDE))
        ->capture_default_str();
    command->add_option("--seeds", options->seeds, "Most seeds of a point, as the budget allows")
        ->type_name("N")
        ->transform(whole_number(2, MOST_SEEDS))
        ->capture_default_str();
    command
        ->add_option("--budget", options->budget,
                     "Seconds for the whole study; cheap points come first, and what there was no time for is named")
        ->type_name("SECONDS")
        ->check(finite_between(1, LONGEST_SECONDS))
        ->capture_default_str();
    command->add_option("-o,--output", options->folder, "Folder for study.csv, study.json, plots and index.html")
        ->check(output_name())
        ->type_name("DIR")
        ->capture_default_str();
    add_common(*command, options->common,
               "  clerestory study -o study\n"
               "  clerestory study grace_latlong.exr --flip-y --budget 60 -o study");
    command->callback([options] { run(*options); });
}

}  // namespace clerestory::commands
