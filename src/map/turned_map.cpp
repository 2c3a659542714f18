#include "map/turned_map.hpp"

#include <algorithm>
#include <cmath>

namespace clerestory {
namespace {

RadianceMap empty_map(std::size_t width, std::size_t height) {
    RadianceMap map;
    map.width = width;
    map.height = height;
    map.rgb = PageBuffer(3 * width * height);
    return map;
}

}  // namespace

RadianceMap turned_map(const RadianceMap& map, double rotate_y_deg) {
    constexpr double FULL_TURN_DEG = 360;
    // A whole column is meant where the angle in degrees had to be rounded.
    constexpr double ROUNDING = 1e-9;
    const auto width = static_cast<double>(map.width);
    double columns = std::remainder(rotate_y_deg, FULL_TURN_DEG) / FULL_TURN_DEG * width;
    if (std::abs(columns - std::round(columns)) <= ROUNDING * width) columns = std::round(columns);
    const double whole = std::floor(columns);
    const auto part = static_cast<float>(columns - whole);
    const auto steps = static_cast<std::size_t>(whole < 0 ? whole + width : whole);
    RadianceMap turned = empty_map(map.width, map.height);
    for (std::size_t i = 0; i < map.height; ++i) {
        const float* from = map.rgb.data() + 3 * i * map.width;
        float* to = turned.rgb.data() + 3 * i * map.width;
        for (std::size_t j = 0; j < map.width; ++j) {
            const std::size_t near = (j + 2 * map.width - steps) % map.width;
            const std::size_t before = (near + map.width - 1) % map.width;
            for (std::size_t c = 0; c < 3; ++c) {
                const float value = from[3 * near + c];
                to[3 * j + c] = part == 0 ? value : (1 - part) * value + part * from[3 * before + c];
            }
        }
    }
    return turned;
}

std::size_t shrink_factor(const RadianceMap& map, std::size_t columns) {
    return std::max<std::size_t>((map.width + columns - 1) / columns, 1);
}

RadianceMap shrunk_map(const RadianceMap& map, std::size_t factor) {
    const auto blocks = [&](std::size_t length) { return (length + factor - 1) / factor; };
    RadianceMap small = empty_map(blocks(map.width), blocks(map.height));
    for (std::size_t i = 0; i < small.height; ++i) {
        for (std::size_t j = 0; j < small.width; ++j) {
            const std::size_t bottom = std::min((i + 1) * factor, map.height);
            const std::size_t right = std::min((j + 1) * factor, map.width);
            double sum[3] = {};
            for (std::size_t y = i * factor; y < bottom; ++y) {
                for (std::size_t x = j * factor; x < right; ++x) {
                    for (std::size_t c = 0; c < 3; ++c)
                        sum[c] += static_cast<double>(map.rgb[3 * (y * map.width + x) + c]);
                }
            }
            const auto texels = static_cast<double>((bottom - i * factor) * (right - j * factor));
            for (std::size_t c = 0; c < 3; ++c) {
                small.rgb[3 * (i * small.width + j) + c] = static_cast<float>(sum[c] / texels);
            }
        }
    }
    return small;
}

}  // namespace clerestory
