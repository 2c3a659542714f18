#pragma once

#include <CLI/CLI.hpp>
#include <memory>

#include "commands/common.hpp"
#include "engine.hpp"
#include "map_request.hpp"
#include "scene.hpp"
#include "sphere.hpp"

namespace clerestory::commands {

/// Adds MAP, --flip-y, --rotate-y, --scale, --luminance and --bad-texels.
void add_map_options(CLI::App& command, MapOptions& options);

/// Adds --exposure and --gamma.
void add_tone_options(CLI::App& command, ToneOptions& tone);

/// Accepts numbers in [low, high]; NaN and infinities are refused.
CLI::Validator finite_between(double low, double high);

/// Builds the scene of a map that was read, with a warning where texels were repaired or none is lit.
std::unique_ptr<Scene> make_scene(const Device& device, TableBuilder& builder, RadianceMap map,
                                  const MapOptions& options, const Common& common,
                                  TableArithmetic arithmetic = TableArithmetic::integer);

/// The same behind the public interface.
Environment make_environment(Engine& engine, RadianceMap map, const MapOptions& options, const Common& common);

}  // namespace clerestory::commands
