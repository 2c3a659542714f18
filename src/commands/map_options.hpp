#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>

#include "commands/common.hpp"
#include "render/map_request.hpp"
#include "render/scene.hpp"
#include "render/scene_loader.hpp"
#include "shading/pixels.hpp"

namespace clerestory::commands {

/// Adds MAP, --layer, --part, --flip-y, --rotate-y, --scale, --luminance and --bad-texels.
void add_map_options(CLI::App& command, MapOptions& options);

/// Adds --exposure and --gamma.
void add_tone_options(CLI::App& command, ToneOptions& tone);

/// The same where the exposure is chosen by the exact sphere unless it is given.
void add_chosen_tone(CLI::App& command, std::optional<double>& exposure, double& gamma);

/// Adds the flags that choose what of a file is read: --layer and --part, or --`prefix`layer and --`prefix`part.
void add_layer_options(CLI::App& command, std::string& layer, std::optional<int>& part, const std::string& of_what,
                       const std::string& prefix = "");

/// Warns of what reading a file has found, once.
void warn_of_source(const MapSource& source, const std::string& file, const Common& common);

/// Says that the bundled map is taken where none was named.
void say_which_map(const MapOptions& options, const Common& common);

/// Starts reading a command's map: the first thing that a command does.
SceneLoader load_scene(const MapOptions& options, const Common& common,
                       TableArithmetic arithmetic = TableArithmetic::integer);

/// The scene that comes of it, with a warning where texels were repaired or none is lit.
std::unique_ptr<Scene> finish_scene(SceneLoader& loader, const Device& device, TableBuilder& builder,
                                    const MapOptions& options, const Common& common);

/// The scene of a map that was read already, with the same warnings; messages name the file.
std::unique_ptr<Scene> make_scene(RadianceMap map, const Device& device, TableBuilder& builder,
                                  const MapOptions& options, const Common& common);

}  // namespace clerestory::commands
