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
    read.layer = options.layer;
    read.part = options.part;
    return read;
}

RadianceMap read_map_of(const MapOptions& options) { return read_map(map_file(options), read_options_of(options)); }

nlohmann::json describe_reading(const MapOptions& options) {
    nlohmann::json reading = {
        {"flip_y", options.flip_y}, {"luminance", options.luminance}, {"bad_texels", options.bad_texels}};
    if (!options.layer.empty()) reading["asked_layer"] = options.layer;
    if (options.part) reading["asked_part"] = *options.part;
    return reading;
}

std::vector<std::string> reading_flags(const MapOptions& options) {
    const MapOptions defaults;
    std::vector<std::string> words;
    if (options.flip_y) words.emplace_back("--flip-y");
    if (options.luminance != defaults.luminance) words.insert(words.end(), {"--luminance", options.luminance});
    if (options.bad_texels != defaults.bad_texels) words.insert(words.end(), {"--bad-texels", options.bad_texels});
    if (!options.layer.empty()) words.insert(words.end(), {"--layer", options.layer});
    if (options.part) words.insert(words.end(), {"--part", std::to_string(*options.part)});
    return words;
}

nlohmann::json describe_source(const MapSource& source) {
    return {{"format", source.format}, {"compression", source.compression},
            {"type", source.type},     {"part", source.part},
            {"layer", source.layer},   {"channels", source.channels}};
}

nlohmann::json describe_map(const MapOptions& options, const RadianceMap& map) {
    nlohmann::json description = describe_reading(options);
    description.update({{"file", map_file(options).string()},
                        {"width", map.width},
                        {"height", map.height},
                        {"rotate_y", options.rotate_y},
                        {"scale", options.scale},
                        {"source", describe_source(map.source)}});
    return description;
}

}  // namespace clerestory
