#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "image.hpp"
#include "shared_types.h"

namespace clerestory {

/// Counts of a whole map (shared_types.h counts a row), with the first place of each kind of bad texel's row.
struct MapCounts {
    std::uint64_t nan = 0;
    std::uint64_t inf = 0;
    std::uint64_t negative = 0;
    std::uint64_t zero = 0;
    float max_component = 0;
    std::size_t first_bad_row = 0;     ///< where `bad()` is not 0
    std::size_t first_bad_column = 0;  ///< where `bad()` is not 0
    [[nodiscard]] std::uint64_t bad() const noexcept { return nan + inf + negative; }
};

/// Joins rows' counts.
MapCounts join_counts(const std::vector<TexelCounts>& rows, std::size_t width);

/// One line that names the count of each kind and the first place, for messages.
std::string describe_bad_texels(const MapCounts& counts);

/// Sets every NaN, infinite or negative component's texel to zero (the whole texel: a colour with one bad component
/// means nothing). Returns how many texels were changed.
std::size_t zero_bad_texels(RadianceMap& map);

}  // namespace clerestory
