#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "draw/canvas.hpp"
#include "render/renderer.hpp"
#include "render/scene.hpp"

namespace clerestory {

/// What a contact sheet shows.
struct SheetOptions {
    std::string title;                ///< such as the map's name
    std::vector<std::size_t> counts;  ///< a row each
    RenderOptions render;             ///< its samples and size are not read
    std::size_t panel = 256;          ///< side of a sphere's picture in pixels; a map is up to twice as wide
    std::optional<double> exposure;   ///< without it the exact sphere's bright end is nearly white
    double gamma = 2.2;
};

/// A sheet, and the numbers that stand on it.
struct Sheet {
    Canvas canvas;
    nlohmann::json report;
};

/// Map and exact sphere, and for each number of samples the samples on the map, the sphere and its error, side by side
/// with their relative RMSE. Spheres are rendered at twice the panel's side and shrunk.
/// Throws InputError where no light is seen, UsageError for a scale of 0, OutputError.
Sheet make_sheet(const Device& device, const Scene& scene, const SheetOptions& options,
                 const ProgressFunction& progress = {});

}  // namespace clerestory
