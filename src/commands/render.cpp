#include "render/renderer.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/atomic_file.hpp"
#include "base/clock.hpp"
#include "base/json_text.hpp"
#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "commands/map_options.hpp"
#include "commands/sampling_options.hpp"
#include "commands/validators.hpp"
#include "error.hpp"
#include "measure/choose_estimator.hpp"
#include "picture/picture_file.hpp"
#include "picture/scene_export.hpp"
#include "render/picture_limits.hpp"
#include "render/picture_recipe.hpp"

namespace clerestory::commands {
namespace {

struct RenderCommand {
    Common common;
    MapOptions map;
    ToneOptions tone;
    DrawOptions draw{.counts = {1024}};
    RenderOptions render;
    std::string estimator = "shared";
    std::vector<std::string> outputs;
    std::vector<std::string> exports;  ///< formats of scene files
    double target_error = 0;           ///< 0: the flags say how to light the sphere
    nlohmann::json target_facts;       ///< how the target is reached; null without one
    bool scenes_name_copy = false;     ///< the map's file is not what other renderers read as this program does
};

/// The file for one count: {samples} is replaced; without it, and with several counts, _N goes before the suffix.
std::string output_name(const std::string& pattern, std::size_t count, bool several) {
    const std::string field = "{samples}";
    const std::string number = std::to_string(count);
    if (const auto at = pattern.find(field); at != std::string::npos) {
        return std::string(pattern).replace(at, field.size(), number);
    }
    if (!several) return pattern;
    const std::filesystem::path path(pattern);
    return (path.parent_path() / (path.stem().string() + "_" + number + path.extension().string())).string();
}

/// The scene file of one count, beside the first picture.
std::string scene_file(const RenderCommand& command, SceneFormat format, std::size_t count) {
    std::filesystem::path first = command.outputs.empty() ? "sphere.exr" : command.outputs.front();
    return output_name(first.replace_extension(scene_suffix(format)).string(), count, command.draw.counts.size() > 1);
}

/// The copy of the map that scene files name where its own file would light otherwise in another renderer.
std::filesystem::path scene_map_file(const RenderCommand& command) {
    const std::filesystem::path first = command.outputs.empty() ? "sphere.exr" : command.outputs.front();
    // One copy serves the scenes of all counts.
    std::string stem = first.stem().string();
    const std::string field = "{samples}";
    if (const auto at = stem.find(field); at != std::string::npos) stem.erase(at, field.size());
    return first.parent_path() / (stem + "_map.exr");
}

void check_outputs(const RenderCommand& command) {
    if (command.outputs.empty() && command.exports.empty() && command.common.json.empty()) {
        throw UsageError("nothing to write: name a picture with -o, such as -o sphere.exr, or a report with --json");
    }
    std::vector<std::filesystem::path> files;
    for (const std::size_t count : command.draw.counts) {
        for (const auto& pattern : command.outputs) {
            check_picture_suffix(pattern);
            files.emplace_back(output_name(pattern, count, command.draw.counts.size() > 1));
        }
        for (const auto& name : command.exports) {
            files.emplace_back(scene_file(command, scene_format_by_name(name), count));
        }
    }
    if (!command.exports.empty()) files.push_back(scene_map_file(command));
    check_files(command.common, {map_file(command.map)}, std::move(files));
}

/// Every parameter of a picture, for its header and the report.
nlohmann::json parameters(const RenderCommand& command, const RenderOptions& options, const Scene& scene,
                          const Device& device) {
    nlohmann::json values = describe_picture(command.map, options, scene.map(), device);
    if (command.draw.table_arithmetic != "integer") values["table_arithmetic"] = command.draw.table_arithmetic;
    if (command.target_facts.is_object()) values.update(command.target_facts);
    return values;
}

/// Writes the map as any renderer reads it, where it must be: its only layer, upright, R, G, B.
void write_scene_map(RenderCommand& command, const Scene& scene) {
    const RadianceMap& map = scene.map();
    command.scenes_name_copy =
        !command.exports.empty() && (!map.source.plain || scene.repaired() != 0 || map.ringing != 0);
    if (!command.scenes_name_copy) return;
    const std::string file = scene_map_file(command).string();
    write_exr_channels(file, map.width, map.height, {"R", "G", "B"}, map.rgb.data(), {});
    say(command.common, file);
}

/// Writes what other renderers need for the same picture, beside the first output; returns the files by format.
nlohmann::json write_scenes(const RenderCommand& command, const RenderOptions& options) {
    nlohmann::json files = nlohmann::json::object();
    const std::filesystem::path map = command.scenes_name_copy ? scene_map_file(command) : map_file(command.map);
    for (const std::string& name : command.exports) {
        const SceneFormat format = scene_format_by_name(name);
        const std::string file = scene_file(command, format, options.samples);
        ExportedScene scene;
        scene.map = std::filesystem::absolute(map).lexically_normal();
        scene.flip_y = command.map.flip_y && !command.scenes_name_copy;
        scene.rotate_y_deg = command.map.rotate_y;
        scene.scale = options.scale;
        scene.albedo = options.albedo;
        scene.size = options.size;
        scene.samples = options.samples;
        scene.stem = std::filesystem::path(file).stem().string();
        write_text(file, scene_text(format, scene));
        files[name] = file;
        say(command.common, file);
    }
    return files;
}

nlohmann::json render_one(const RenderCommand& command, Renderer& renderer, const Scene& scene, const Device& device,
                          std::size_t count, const nlohmann::json& before) {
    RenderOptions options = command.render;
    options.estimator = estimator_by_name(command.estimator);
    options.samples = count;
    options.scale = command.map.scale;
    const auto control_degree = options.sampling.control_degree;
    options.sampling = sampling_of(command.draw, command.common, command.map.rotate_y);
    options.sampling.control_degree = control_degree;
    Progress progress(command.common, fmt::format("render {}", command.estimator));
    Stopwatch watch;
    const Rendered picture =
        renderer.render(scene, options, [&](double done, double total) { progress.update(done, total); });
    nlohmann::json seconds = before;
    for (const auto& [stage, value] : picture.seconds) seconds[stage] = value;
    seconds["render"] = watch.lap();
    nlohmann::json result = parameters(command, options, scene, device);
    const Header header = flat_header(result, seconds);
    result["outputs"] = nlohmann::json::array();
    for (const auto& pattern : command.outputs) {
        const std::string name = output_name(pattern, count, command.draw.counts.size() > 1);
        write_picture(name, picture, command.tone, renderer.display(), header);
        result["outputs"].push_back(name);
        say(command.common, name);
    }
    if (!command.exports.empty()) result["scenes"] = write_scenes(command, options);
    seconds["write"] = watch.lap();
    result["seconds"] = seconds;
    detail(command.common, json_text(seconds, -1));
    return result;
}

/// The command with the estimator and all that belongs to it as --target-error chooses them.
RenderCommand with_target_reached(RenderCommand command, Renderer& renderer, const Scene& scene) {
    RenderOptions asked = command.render;
    asked.sampling = sampling_of(command.draw, command.common, command.map.rotate_y);
    const TargetChoice choice = choose_estimator(renderer, scene, asked, command.target_error);
    command.estimator = estimator_name(choice.method.estimator);
    command.draw.counts = {choice.method.samples};
    command.draw.sequence = sequence_name(choice.method.sampling.sequence);
    command.render.sampling.control_degree = choice.method.sampling.control_degree;
    command.render.harmonic = choice.method.harmonic;
    command.target_facts = {{"target_error", command.target_error},
                            {"reached_error", choice.reached_error},
                            {"choice", choice.choice},
                            {"why", choice.why}};
    say(command.common, fmt::format("{}: relative RMSE {:.2g} where {:.2g} was asked; {}", choice.choice,
                                    choice.reached_error, command.target_error, choice.why));
    return command;
}

void run(RenderCommand command) {
    check_outputs(command);
    const Stopwatch total;
    Stopwatch watch;
    SceneLoader loader =
        load_scene(command.map, command.common, table_arithmetic_by_name(command.draw.table_arithmetic));
    const Device device = open_device(command.common);
    TableBuilder builder(device);
    nlohmann::json before = {{"device", watch.lap()}};
    const auto scene = finish_scene(loader, device, builder, command.map, command.common);
    // These three overlap.
    before["read"] = loader.read_seconds();
    before["tables"] = scene->build_seconds();
    watch.lap();
    Renderer renderer(device);
    if (command.target_error > 0) {
        command = with_target_reached(std::move(command), renderer, *scene);
        before["choose"] = watch.lap();
    }
    write_scene_map(command, *scene);
    nlohmann::json report = {{"renders", nlohmann::json::array()}};
    for (const std::size_t count : command.draw.counts) {
        report["renders"].push_back(render_one(command, renderer, *scene, device, count, before));
    }
    // The last picture's keys stand at the top too: with one count, which is the rule, the report is flat.
    report.update(report["renders"].back());
    report["seconds"]["total"] = total.seconds();
    emit_json(command.common, report);
}

}  // namespace

void add_render(CLI::App& app) {
    auto* command = app.add_subcommand("render", "Light a diffuse sphere with a map");
    auto options = std::make_shared<RenderCommand>();
    add_map_options(*command, options->map);
    add_draw_options(*command, options->draw);
    command->add_option("--estimator", options->estimator, "How light is added up")
        ->check(one_of(estimator_names()))
        ->capture_default_str();
    add_control_degree(*command, options->render.sampling.control_degree);
    command->add_option("--degree", options->render.harmonic.degree, "Degree of --estimator harmonic")
        ->transform(whole_number(0, HarmonicOptions::MAX_DEGREE))
        ->capture_default_str();
    command
        ->add_option("--lights", options->render.harmonic.lights,
                     "Brightest texels that --estimator harmonic takes as lights of their own")
        ->transform(whole_number(0, HarmonicOptions::MAX_LIGHTS))
        ->capture_default_str();
    command->add_option("--size", options->render.size, "Pixels of a side")
        ->transform(whole_number(1, limits::LARGEST_SIDE))
        ->capture_default_str();
    command->add_option("--albedo", options->render.albedo, "Share of light that the sphere reflects")
        ->check(finite_between(0, limits::LARGEST_ALBEDO))
        ->capture_default_str();
    constexpr double SMALLEST_TARGET = 1e-9;
    auto* target = command
                       ->add_option("--target-error", options->target_error,
                                    "Choose the fastest way whose relative RMSE on this map is at most X")
                       ->type_name("X")
                       ->check(finite_between(SMALLEST_TARGET, 1));
    for (const char* decided : {"--samples", "--estimator", "--sequence", "--control-degree", "--degree", "--lights"}) {
        target->excludes(command->get_option(decided));
    }
    add_tone_options(*command, options->tone);
    command
        ->add_option("-o,--output", options->outputs,
                     "File to write, .exr or .png; may repeat; {samples} in it becomes the number of samples")
        ->type_name("FILE")
        ->expected(1)
        ->check(output_name())
        ->take_all();
    command
        ->add_option("--export", options->exports,
                     "Write also the scene that gives this picture in pbrt-v4 (.pbrt) or Mitsuba 3 (.xml), named as "
                     "the first output, with N samples a pixel")
        ->delimiter(',')
        ->type_name("RENDERER[,...]")
        ->check(one_of(scene_format_names()));
    add_common(*command, options->common,
               "  clerestory render studio.exr -n 1024 --estimator shared -o sphere.exr -o sphere.png\n"
               "  clerestory render studio.exr -n 8,16,32 --estimator per-pixel -o 'sphere_{samples}.png'\n"
               "  clerestory render studio.exr --target-error 0.001 -o sphere.exr");
    command->callback([options] { run(*options); });
}

}  // namespace clerestory::commands
