#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "commands/common.hpp"
#include "engine.hpp"
#include "environment.hpp"
#include "scene.hpp"
#include "sphere.hpp"

namespace clerestory::commands {

/// The map and how it is read and turned.
struct MapOptions {
    std::string file;  ///< empty: the bundled map
    bool flip_y = false;
    double rotate_y = 0;  ///< degrees
    double scale = 1;
    std::string luminance = "average";
    std::string bad_texels = "refuse";
};

/// Adds MAP, --flip-y, --rotate-y, --scale, --luminance and --bad-texels.
void add_map_options(CLI::App& command, MapOptions& options);

/// Adds --exposure and --gamma.
void add_tone_options(CLI::App& command, ToneOptions& tone);

/// Accepts numbers in [low, high]; NaN and infinities are refused.
CLI::Validator finite_between(double low, double high);

/// The file that is read: the one named, or the bundled map.
std::filesystem::path map_file(const MapOptions& options);

Luminance luminance_of(const MapOptions& options);

/// Reads the map; messages name the file.
RadianceMap read_map_of(const MapOptions& options);

/// Builds the scene of a map that was read, with a warning where texels were repaired or none is lit.
std::unique_ptr<Scene> make_scene(const Device& device, TableBuilder& builder, RadianceMap map,
                                  const MapOptions& options, const Common& common);

/// The same behind the public interface.
Environment make_environment(Engine& engine, RadianceMap map, const MapOptions& options, const Common& common);

/// The map's part of a report: file, size, orientation.
nlohmann::json describe_map(const MapOptions& options, const RadianceMap& map);

}  // namespace clerestory::commands
