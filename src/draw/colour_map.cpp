#include "draw/colour_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/statistics.hpp"

namespace clerestory {
namespace {

// From -1 to 1 and from 0 to 1 in even steps, 8-bit sRGB.
constexpr std::array<Colour, 5> DIVERGING = {
    {{14, 54, 112}, {66, 142, 205}, {246, 246, 242}, {232, 140, 54}, {128, 52, 0}}};
constexpr std::array<Colour, 3> SEQUENTIAL = {{{246, 246, 242}, {178, 130, 196}, {66, 18, 96}}};

template <std::size_t N>
Colour between(const std::array<Colour, N>& stops, double share) {
    const double at = std::clamp(share, 0.0, 1.0) * (N - 1);
    const auto low = std::min(static_cast<std::size_t>(at), N - 2);
    const double part = at - static_cast<double>(low);
    Colour colour{};
    for (std::size_t c = 0; c < 3; ++c) colour[c] = (1 - part) * stops[low][c] + part * stops[low + 1][c];
    return colour;
}

}  // namespace

double colour_place(double value) { return std::copysign(std::sqrt(std::min(std::abs(value), 1.0)), value); }

Colour colour_at(ColourMap map, double place) {
    return map == ColourMap::diverging ? between(DIVERGING, (place + 1) / 2) : between(SEQUENTIAL, place);
}

std::vector<unsigned char> coloured(std::span<const float> values, ColourMap map, double limit) {
    std::vector<unsigned char> bytes(4 * values.size(), 0);
    for (std::size_t i = 0; i < values.size(); ++i) {
        const auto value = static_cast<double>(values[i]);
        if (std::isnan(value)) continue;
        const Colour colour = colour_at(map, colour_place(value / limit));
        for (std::size_t c = 0; c < 3; ++c) bytes[4 * i + c] = static_cast<unsigned char>(std::lround(colour[c]));
        bytes[4 * i + 3] = 255;
    }
    return bytes;
}

double round_limit(const std::vector<std::span<const float>>& pictures) {
    constexpr double SHARE = 0.995;
    std::vector<double> sizes;
    for (const auto& values : pictures) {
        for (const float value : values) {
            if (std::isfinite(value)) sizes.push_back(std::abs(static_cast<double>(value)));
        }
    }
    const double wanted = quantile(std::move(sizes), SHARE);
    if (!(wanted > 0)) return 1;
    const double power = std::pow(10, std::floor(std::log10(wanted)));
    for (const double digit : {1.0, 2.0, 5.0}) {
        if (digit * power >= wanted) return digit * power;
    }
    return 10 * power;
}

std::string tick_percent(double share) { return fmt::format("{}%", std::round(share * 1e6) / 1e4); }

}  // namespace clerestory
