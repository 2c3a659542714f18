#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "image.hpp"
#include "options.hpp"
#include "render/scene.hpp"

namespace clerestory {

/// The map and how it is read and turned.
struct MapOptions {
    std::string file;  ///< empty: the bundled map
    bool flip_y = false;
    double rotate_y = 0;  ///< degrees
    double scale = 1;
    std::string luminance = "average";
    std::string bad_texels = "refuse";
    std::string layer;        ///< empty: the one that is the picture
    std::optional<int> part;  ///< of the file, from 0; without: the first that holds the picture
};

/// The file that is read: the one named, or the bundled map.
std::filesystem::path map_file(const MapOptions& options);

Luminance luminance_of(const MapOptions& options);

/// How the map's tables are built and its bad texels taken.
EnvironmentOptions environment_options_of(const MapOptions& options);
/// The same for the stages behind it.
SceneOptions scene_options_of(const MapOptions& options);

/// How its file is read.
ReadOptions read_options_of(const MapOptions& options);

/// Reads the map; messages name the file.
RadianceMap read_map_of(const MapOptions& options);

/// What decides a map's texels and tables beside its file: jobs that agree in it and in the file share a scene.
nlohmann::json describe_reading(const MapOptions& options);

/// The same as flags, where they are not the defaults.
std::vector<std::string> reading_flags(const MapOptions& options);

/// What of the file lit: its format, compression and type, the part, layer and channels.
nlohmann::json describe_source(const MapSource& source);

/// The map's part of a report: file, size, orientation.
nlohmann::json describe_map(const MapOptions& options, const RadianceMap& map);

}  // namespace clerestory
