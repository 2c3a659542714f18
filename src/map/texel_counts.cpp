#include "map/texel_counts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace clerestory {

MapCounts join_counts(const std::vector<TexelCounts>& rows, std::size_t width) {
    MapCounts joined;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const TexelCounts& row = rows[i];
        if (joined.bad() == 0 && row.first_bad < width) {
            joined.first_bad_row = i;
            joined.first_bad_column = row.first_bad;
        }
        joined.nan += row.nan_count;
        joined.inf += row.inf_count;
        joined.negative += row.negative_count;
        joined.zero += row.zero_count;
        joined.max_component = std::max(joined.max_component, row.max_component);
    }
    return joined;
}

std::string describe_bad_texels(const MapCounts& counts) {
    return fmt::format("{} NaN, {} infinite and {} negative texels, the first at row {}, column {}", counts.nan,
                       counts.inf, counts.negative, counts.first_bad_row, counts.first_bad_column);
}

std::size_t zero_bad_texels(RadianceMap& map) {
    std::size_t changed = 0;
    for (std::size_t i = 0; i < map.width * map.height; ++i) {
        float* texel = map.rgb.data() + 3 * i;
        if (std::all_of(texel, texel + 3, [](float v) { return std::isfinite(v) && v >= 0; })) continue;
        std::fill(texel, texel + 3, 0.0F);
        ++changed;
    }
    return changed;
}

}  // namespace clerestory
