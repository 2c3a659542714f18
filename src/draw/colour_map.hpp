#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

namespace clerestory {

/// How values become colours. Both maps hold for readers with any common colour blindness, and their middle or end is
/// pale on light and dark ground alike.
enum class ColourMap {
    diverging,   ///< blue below 0, orange above
    sequential,  ///< pale at 0, purple at the limit
};

/// Red, green and blue from 0 to 255, sRGB.
using Colour = std::array<double, 3>;

/// Place on the colour map, -1 .. 1 or 0 .. 1, of a value in parts of the limit. It goes with the root of the value, so
/// that a tenth of the limit still shows.
double colour_place(double value);

Colour colour_at(ColourMap map, double place);

/// Values as colours; NaN becomes transparent.
///   returns [4 * values]  RGBA
std::vector<unsigned char> coloured(std::span<const float> values, ColourMap map, double limit);

/// A round limit (1, 2 or 5 times a power of ten) that only 1 of 200 sizes of finite values is above; 1 where there is
/// none above 0.
double round_limit(const std::vector<std::span<const float>>& pictures);

/// A share as a scale bar writes it, such as 2.5%.
std::string tick_percent(double share);

}  // namespace clerestory
