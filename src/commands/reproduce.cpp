#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/atomic_file.hpp"
#include "base/clock.hpp"
#include "base/durable.hpp"
#include "base/json_text.hpp"
#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "commands/map_options.hpp"
#include "commands/validators.hpp"
#include "reproduce/figures.hpp"
#include "reproduce/report_page.hpp"

namespace clerestory::commands {
namespace {

struct ReproduceCommand {
    Common common;
    MapOptions map;
    FigureOptions figures;
    std::string folder = "reproduce";
};

/// The map as the figures' own command lines name it.
std::vector<std::string> map_words(const MapOptions& options) {
    std::vector<std::string> words = reading_flags(options);
    if (!options.file.empty()) words.insert(words.begin(), options.file);
    return words;
}

/// Draws a bar for each kind of work in turn.
class ProgressOfEach {
  public:
    explicit ProgressOfEach(const Common& common) : common_(common) {}
    void update(const std::string& title, double done, double total) {
        if (!bar_ || title != title_) {
            bar_ = std::make_unique<Progress>(common_, title);
            title_ = title;
        }
        bar_->update(done, total);
    }
    void clear() { bar_.reset(); }

  private:
    const Common& common_;
    std::string title_;
    std::unique_ptr<Progress> bar_;
};

nlohmann::json provenance(const ReproduceCommand& command, const Scene& scene, const Device& device) {
    const auto now = std::chrono::time_point_cast<std::chrono::seconds>(std::chrono::system_clock::now());
    auto map = describe_map(command.map, scene.map());
    map["name"] = map_file(command.map).filename().string();
    map["phi"] = scene.distribution().phi;
    map["max_component"] = scene.distribution().counts.max_component;
    return {{"program", "clerestory"},
            {"version", CLERESTORY_VERSION},
            {"created", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now))},
            {"device", device.info().name},
            {"platform", device.info().version},
            {"compute_units", device.info().compute_units},
            {"map", map},
            {"seed", command.common.seed},
            {"seeds", command.figures.seeds},
            {"size", command.figures.size},
            {"gamma", command.figures.gamma}};
}

/// Refuses files that would be harmed, before any work.
void check_files_of_figures(const ReproduceCommand& command) {
    const std::filesystem::path folder(command.folder);
    std::vector<std::filesystem::path> files = {folder / "report.json", folder / "index.html"};
    for (const auto& id : figure_ids()) {
        for (const char* ending : {".svg", ".png", ".csv", "_control.png"}) files.push_back(folder / (id + ending));
    }
    check_files(command.common, {map_file(command.map)}, std::move(files));
}

void run(const ReproduceCommand& command) {
    check_files_of_figures(command);
    const Stopwatch total;
    SceneLoader loader = load_scene(command.map, command.common);
    const Device device = open_device(command.common);
    TableBuilder builder(device);
    const auto scene = finish_scene(loader, device, builder, command.map, command.common);
    FigureOptions options = command.figures;
    options.folder = command.folder;
    options.map_words = map_words(command.map);
    options.rotate_y_deg = command.map.rotate_y;
    options.scale = command.map.scale;
    options.seed = command.common.seed;
    ProgressOfEach progress(command.common);
    const auto written = [&](const std::string& file) {
        progress.clear();
        say(command.common, file);
    };
    Figures figures(device, *scene, options, {written, [&](const std::string& title, double done, double whole) {
                                                  progress.update(title, done, whole);
                                              }});
    figures.make();
    nlohmann::json report = provenance(command, *scene, device);
    report.update(figures.report());
    report["seconds"] = total.seconds();
    if (options.only.empty()) {
        const std::filesystem::path folder(command.folder);
        sync_remembered();  // the report says that the figures are there
        write_text(folder / "report.json", json_text(report));
        written((folder / "report.json").string());
        write_text(folder / "index.html", report_page(report, figures.pictures()));
        written((folder / "index.html").string());
    }
    emit_json(command.common, report);
}

}  // namespace

void add_reproduce(CLI::App& app) {
    constexpr std::size_t SMALLEST_SIDE = 16;
    constexpr std::size_t LARGEST_SIDE = 4096;
    constexpr std::size_t MOST_SEEDS = 1000;
    auto* command = app.add_subcommand(
        "reproduce", "Make every figure of the course report, measure what it claims, and put all of it on one page");
    auto options = std::make_shared<ReproduceCommand>();
    options->map.rotate_y = options->figures.rotate_y_deg;
    add_map_options(*command, options->map);
    command->add_option("--size", options->figures.size, "Pixels of a sphere picture's side")
        ->transform(whole_number(SMALLEST_SIDE, LARGEST_SIDE))
        ->capture_default_str();
    command->add_option("--seeds", options->figures.seeds, "Seeds over which errors are studied")
        ->type_name("N")
        ->transform(whole_number(2, MOST_SEEDS))
        ->capture_default_str();
    command
        ->add_option("--only", options->figures.only,
                     "Make these figures alone, such as figure_07,figure_12, and neither report nor page")
        ->delimiter(',')
        ->type_name("FIGURE[,...]");
    add_chosen_tone(*command, options->figures.exposure, options->figures.gamma);
    command->add_option("-o,--output", options->folder, "Folder for the figures, report.json and index.html")
        ->check(output_name())
        ->type_name("DIR")
        ->capture_default_str();
    add_common(*command, options->common,
               "  clerestory reproduce -o figures\n"
               "  clerestory reproduce grace_latlong.exr --flip-y -o figures\n"
               "  clerestory reproduce studio.exr --only figure_15 -o slides");
    command->callback([options] { run(*options); });
}

}  // namespace clerestory::commands
