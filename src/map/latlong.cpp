#include "map/latlong.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace clerestory {

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

std::vector<double> texel_solid_angles(std::size_t width, std::size_t height) {
    constexpr double pi = std::numbers::pi;
    const auto h = static_cast<double>(height);
    const double factor = 2 * pi / static_cast<double>(width) * 2 * std::sin(pi / (2 * h));
    std::vector<double> angles(height);
    for (std::size_t i = 0; i < height; ++i) {
        const auto from_pole = static_cast<double>(std::min(i, height - 1 - i));
        angles[i] = factor * std::sin(pi * (from_pole + 0.5) / h);
    }
    return angles;
}

}  // namespace clerestory
