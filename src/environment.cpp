#include "environment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace clerestory {

std::array<double, 3> luminance_weights(Luminance luminance) {
    // Rec. ITU-R BT.709-6, item 3.2.
    if (luminance == Luminance::rec709) return {0.2126, 0.7152, 0.0722};
    return {1.0 / 3, 1.0 / 3, 1.0 / 3};
}

std::array<float, 3> luminance_weights_f32(Luminance luminance) {
    const auto weights = luminance_weights(luminance);
    return {static_cast<float>(weights[0]), static_cast<float>(weights[1]), static_cast<float>(weights[2])};
}

MapCensus join_census(const std::vector<Census>& rows, std::size_t width) {
    MapCensus joined;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const Census& row = rows[i];
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

std::string describe_bad_texels(const MapCensus& census) {
    return fmt::format("{} NaN, {} infinite and {} negative texels, the first at row {}, column {}", census.nan,
                       census.inf, census.negative, census.first_bad_row, census.first_bad_column);
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

RowGeometry row_geometry(std::size_t width, std::size_t height) {
    constexpr double pi = std::numbers::pi;
    const auto h = static_cast<double>(height);
    RowGeometry geometry;
    geometry.frames.reserve(height);
    geometry.sine.reserve(height);
    for (std::size_t i = 0; i < height; ++i) {
        const bool north = i <= height - 1 - i;
        const auto from_pole = static_cast<double>(north ? i : height - 1 - i);
        const double sine = std::sin(pi * (from_pole + 0.5) / h);
        const double near_edge = std::sin(pi * from_pole / (2 * h));
        // sin^2(b) - sin^2(a) = sin(b + a) sin(b - a): no cancellation.
        const double cap_step = sine * std::sin(pi / (2 * h));
        const double solid_angle = 2 * pi / static_cast<double>(width) * 2 * std::sin(pi / (2 * h)) * sine;
        geometry.frames.push_back({static_cast<float>(near_edge * near_edge), static_cast<float>(cap_step),
                                   north ? 1.0F : -1.0F, static_cast<float>(solid_angle)});
        geometry.sine.push_back(static_cast<float>(sine));
    }
    return geometry;
}

}  // namespace clerestory
