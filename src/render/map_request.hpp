#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

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

/// The map's part of a report: file, size, orientation.
nlohmann::json describe_map(const MapOptions& options, const RadianceMap& map);

}  // namespace clerestory
