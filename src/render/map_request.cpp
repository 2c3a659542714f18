#include "render/map_request.hpp"

#include <nlohmann/json.hpp>

#include "bundled.hpp"

namespace clerestory {

std::filesystem::path map_file(const MapOptions& options) {
    return options.file.empty() ? bundled_map(DEFAULT_MAP) : std::filesystem::path(options.file);
}

Luminance luminance_of(const MapOptions& options) {
    return options.luminance == "rec709" ? Luminance::rec709 : Luminance::average;
}

EnvironmentOptions environment_options_of(const MapOptions& options) {
    return {.luminance = luminance_of(options),
            .bad_texels = options.bad_texels == "zero" ? BadTexels::zero : BadTexels::refuse};
}

SceneOptions scene_options_of(const MapOptions& options) {
    const EnvironmentOptions environment = environment_options_of(options);
    SceneOptions scene;
    scene.tables.luminance = environment.luminance;
    scene.bad_texels = environment.bad_texels;
    return scene;
}

ReadOptions read_options_of(const MapOptions& options) {
    ReadOptions read;
    read.flip_y = options.flip_y;
    return read;
}

RadianceMap read_map_of(const MapOptions& options) { return read_map(map_file(options), read_options_of(options)); }

nlohmann::json describe_map(const MapOptions& options, const RadianceMap& map) {
    return {{"file", map_file(options).string()},
            {"width", map.width},
            {"height", map.height},
            {"flip_y", options.flip_y},
            {"rotate_y", options.rotate_y},
            {"scale", options.scale},
            {"luminance", options.luminance},
            {"bad_texels", options.bad_texels}};
}

}  // namespace clerestory
