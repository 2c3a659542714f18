#include "inspect.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "map/latlong.hpp"
#include "map/luminance.hpp"

namespace clerestory {
namespace {

void count(TexelCount& found, std::size_t row, std::size_t column) {
    if (found.count++ == 0) {
        found.row = row;
        found.column = column;
    }
}

/// Counts a texel that carries no light or none that can be used; false where it is lit.
bool counted_unlit(MapFacts& facts, const float* texel, std::size_t row, std::size_t column) {
    const auto any = [&](auto test) { return std::any_of(texel, texel + 3, test); };
    if (any([](float v) { return std::isnan(v); })) {
        count(facts.nan, row, column);
    } else if (any([](float v) { return std::isinf(v); })) {
        count(facts.inf, row, column);
    } else if (any([](float v) { return v < 0; })) {
        count(facts.negative, row, column);
    } else if (!any([](float v) { return v > 0; })) {
        count(facts.zero, row, column);
    } else {
        return false;
    }
    return true;
}

}  // namespace

double MapFacts::stops() const { return min_intensity > 0 ? std::log2(max_intensity / min_intensity) : 0; }

MapFacts inspect(const RadianceMap& map, Luminance luminance) {
    const auto weights = luminance_weights(luminance);
    const std::vector<double> solid_angles = texel_solid_angles(map.width, map.height);
    MapFacts facts;
    for (std::size_t i = 0; i < map.height; ++i) {
        std::array<double, 3> row_sum = {};
        for (std::size_t j = 0; j < map.width; ++j) {
            const float* texel = map.rgb.data() + 3 * (i * map.width + j);
            if (counted_unlit(facts, texel, i, j)) continue;
            double intensity = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                row_sum[c] += static_cast<double>(texel[c]);
                intensity += weights[c] * static_cast<double>(texel[c]);
            }
            facts.min_intensity = facts.max_intensity == 0 ? intensity : std::min(facts.min_intensity, intensity);
            if (intensity > facts.max_intensity) {
                facts.max_intensity = intensity;
                facts.max_row = i;
                facts.max_column = j;
            }
        }
        for (std::size_t c = 0; c < 3; ++c) {
            facts.mean_rgb[c] += row_sum[c] * solid_angles[i] / (4 * std::numbers::pi);
            facts.phi += row_sum[c] * solid_angles[i] * weights[c];
        }
    }
    return facts;
}

}  // namespace clerestory
