#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "image.hpp"
#include "options.hpp"
#include "shared_types.h"

namespace clerestory {

/// Weights of R, G and B in the intensity.
std::array<double, 3> luminance_weights(Luminance luminance);
/// The same, rounded to what the kernels take.
std::array<float, 3> luminance_weights_f32(Luminance luminance);

/// A census of a whole map (shared_types.h counts a row), with the first place of each kind of bad texel's row.
struct MapCensus {
    std::uint64_t nan = 0;
    std::uint64_t inf = 0;
    std::uint64_t negative = 0;
    std::uint64_t zero = 0;
    float max_component = 0;
    std::size_t first_bad_row = 0;     ///< where `bad()` is not 0
    std::size_t first_bad_column = 0;  ///< where `bad()` is not 0
    [[nodiscard]] std::uint64_t bad() const noexcept { return nan + inf + negative; }
};

/// Joins rows' censuses.
MapCensus join_census(const std::vector<Census>& rows, std::size_t width);

/// One line that names the count of each kind and the first place, for messages.
std::string describe_bad_texels(const MapCensus& census);

/// Sets every NaN, infinite or negative component's texel to zero (the whole texel: a colour with one bad component
/// means nothing). Returns how many texels were changed.
std::size_t zero_bad_texels(RadianceMap& map);

/// Where the map's rows lie on the sphere; computed in double, rounded once.
struct RowGeometry {
    std::vector<RowFrame> frames;  ///< [height]
    std::vector<float> sine;       ///< [height], sin(theta) at the row's centre
};
RowGeometry row_geometry(std::size_t width, std::size_t height);

}  // namespace clerestory
