#pragma once

#include <cstddef>
#include <cstdint>

#include "render/picture_recipe.hpp"

namespace clerestory {

/// Estimated time in nanoseconds on two cores of a server, good to a factor of two or so: enough to share jobs out
/// evenly and to say whether a batch takes a minute or a night.
std::uint64_t picture_cost_ns(const RenderOptions& options, std::size_t map_width, std::size_t map_height,
                              std::size_t outputs);
/// The same for reading a map and building its tables.
std::uint64_t map_cost_ns(std::size_t width, std::size_t height);

/// Memory of a map while it is read: DWA's blocks take three times what the map does.
std::size_t reading_bytes(std::size_t width, std::size_t height);
/// Memory of a map and its tables, and of one picture on its way from the device to its files.
std::size_t scene_bytes(std::size_t width, std::size_t height);
std::size_t picture_bytes(std::size_t size);
/// Memory of an estimator at work, beside the map and the picture.
std::size_t estimator_bytes(const RenderOptions& options, std::size_t texels);

}  // namespace clerestory
