#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "image.hpp"

/// Maps that tests share: the hard cases, by name.
namespace clerestory::test {

/// Radiance of the texel at (row, column).
using TexelFunction = std::function<std::array<float, 3>(std::size_t row, std::size_t column)>;

RadianceMap make_map(std::size_t width, std::size_t height, const TexelFunction& texel);

/// Grey maps.
RadianceMap constant_map(std::size_t width, std::size_t height, float value);
RadianceMap lone_texel_map(std::size_t width, std::size_t height, std::size_t row, std::size_t column, float value = 1);
RadianceMap checkerboard_map(std::size_t width, std::size_t height, float value = 1);
/// Rows (or columns) 1, 3, 5 ... lit, the others black.
RadianceMap striped_map(std::size_t width, std::size_t height, bool by_rows, float value = 1);
/// `sky` everywhere but in the first (or the last) `suns` texels of `row`.
RadianceMap sun_map(std::size_t width, std::size_t height, std::size_t row, std::size_t suns, float sun, float sky,
                    bool at_start);
/// Radiance that differs by channel and from texel to texel, rising along rows and down columns.
RadianceMap ramp_map(std::size_t width, std::size_t height);
/// Radiance spread over many orders of magnitude, with black texels between; a pure function of `seed`.
RadianceMap random_map(std::size_t width, std::size_t height, unsigned seed);
/// Six blocks of one colour each: two rows of three, from the top left red, green, blue, cyan, magenta, yellow.
RadianceMap block_map(std::size_t width, std::size_t height);
/// The map with each value of `values` as one texel of its only row, grey.
RadianceMap row_map(std::span<const float> values);

struct NamedMap {
    std::string name;  ///< in letters and digits, for test names
    std::function<RadianceMap()> make;
};

/// Every hard map with at least one lit texel and none that is bad, small enough for the default suite.
std::vector<NamedMap> hard_maps();

/// The maps of data/, by name.
std::vector<std::pair<std::string, RadianceMap>> bundled_maps();

}  // namespace clerestory::test
