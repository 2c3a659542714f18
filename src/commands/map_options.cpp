#include "commands/map_options.hpp"

#include <fmt/format.h>

#include <utility>

#include "commands/validators.hpp"
#include "error.hpp"
#include "render/picture_limits.hpp"

namespace clerestory::commands {
namespace {

void warn_of_map(const MapOptions& options, const Common& common, const RadianceMap& map, std::size_t repaired,
                 bool black) {
    const std::string file = map_file(options).string();
    warn_of_source(map.source, file, common);
    if (repaired != 0) {
        warn(common, fmt::format("{}: {} NaN, infinite or negative texels were blackened", file, repaired));
    }
    if (black) warn(common, fmt::format("{}: the map is black", file));
}

constexpr const char* PREVIEW = "Preview";

void add_gamma(CLI::App& command, double& gamma) {
    command.add_option("--gamma", gamma, "Gamma of the 8-bit pictures")
        ->type_name("X")
        ->check(finite_between(1 / limits::LARGEST_GAMMA, limits::LARGEST_GAMMA))
        ->capture_default_str()
        ->group(PREVIEW);
}

}  // namespace

void add_map_options(CLI::App& command, MapOptions& options) {
    const char* group = "Map";
    command
        .add_option("MAP", options.file, "Latitude-longitude HDR map: EXR, HDR, PFM, TIFF; without it the bundled map")
        ->check(not_empty())
        ->group(group);
    add_layer_options(command, options.layer, options.part, "the map's file");
    command.add_flag("--flip-y", options.flip_y, "The map's rows are stored bottom-up")->group(group);
    command.add_option("--rotate-y", options.rotate_y, "Turn the map about +y by DEGREES, added to phi")
        ->type_name("DEGREES")
        ->check(finite_between(-limits::LARGEST_ROTATION_DEG, limits::LARGEST_ROTATION_DEG))
        ->capture_default_str()
        ->group(group);
    command.add_option("--scale", options.scale, "Multiply the map's radiance")
        ->type_name("X")
        ->check(finite_between(0, limits::LARGEST_SCALE))
        ->capture_default_str()
        ->group(group);
    command.add_option("--luminance", options.luminance, "Intensity: (R + G + B) / 3, or by Rec. 709's weights")
        ->check(one_of({"average", "rec709"}))
        ->capture_default_str()
        ->group(group);
    command
        .add_option("--bad-texels", options.bad_texels,
                    "NaN, infinite and negative texels: refuse the map, or blacken them")
        ->check(one_of({"refuse", "zero"}))
        ->capture_default_str()
        ->group(group);
}

void add_layer_options(CLI::App& command, std::string& layer, std::optional<int>& part, const std::string& of_what,
                       const std::string& prefix) {
    const char* group = "Map";
    command
        .add_option(
            "--" + prefix + "layer", layer,
            fmt::format("Layer of {} to read, such as Combined; without it, the unnamed one or the whole picture",
                        of_what))
        ->type_name("NAME")
        ->check(not_empty())
        ->group(group);
    command
        .add_option("--" + prefix + "part", part,
                    fmt::format("Part or page of {} to read, from 0; without it, the first with the picture", of_what))
        ->type_name("N")
        ->transform(whole_number(0, limits::LARGEST_PART))
        ->group(group);
}

void warn_of_source(const MapSource& source, const std::string& file, const Common& common) {
    for (const MapNote& note : source.notes) warn(common, fmt::format("{}: {}", file, note.text));
}

void add_chosen_tone(CLI::App& command, std::optional<double>& exposure, double& gamma) {
    command
        .add_option("--exposure", exposure,
                    "Multiply the 8-bit pictures; without it, the exact sphere's bright end is nearly white")
        ->type_name("X")
        ->check(finite_between(1 / limits::LARGEST_EXPOSURE, limits::LARGEST_EXPOSURE))
        ->group(PREVIEW);
    add_gamma(command, gamma);
}

void add_tone_options(CLI::App& command, ToneOptions& tone) {
    command.add_option("--exposure", tone.exposure, "Multiply the 8-bit preview")
        ->type_name("X")
        ->check(finite_between(0, limits::LARGEST_EXPOSURE))
        ->capture_default_str()
        ->group(PREVIEW);
    add_gamma(command, tone.gamma);
}

void say_which_map(const MapOptions& options, const Common& common) {
    if (!options.file.empty()) return;
    say(common, fmt::format("no map named: the bundled {}", map_file(options).stem().string()));
}

SceneLoader load_scene(const MapOptions& options, const Common& common, TableArithmetic arithmetic) {
    say_which_map(options, common);
    SceneOptions scene = scene_options_of(options);
    scene.arithmetic = arithmetic;
    return {map_file(options), read_options_of(options), scene};
}

std::unique_ptr<Scene> finish_scene(SceneLoader& loader, const Device& device, TableBuilder& builder,
                                    const MapOptions& options, const Common& common) {
    auto scene = loader.finish(device, builder);
    warn_of_map(options, common, scene->map(), scene->repaired(), scene->distribution().black());
    return scene;
}

std::unique_ptr<Scene> make_scene(RadianceMap map, const Device& device, TableBuilder& builder,
                                  const MapOptions& options, const Common& common) {
    try {
        auto scene = std::make_unique<Scene>(device, builder, std::move(map), scene_options_of(options));
        warn_of_map(options, common, scene->map(), scene->repaired(), scene->distribution().black());
        return scene;
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", map_file(options).string(), error.what()));
    }
}

}  // namespace clerestory::commands
