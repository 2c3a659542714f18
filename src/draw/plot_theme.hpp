#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "draw/plot.hpp"

namespace clerestory::plot {

/// One colour on a light and on a dark ground, as #rrggbb, and the dashes and marks that tell it apart without colour.
struct Ink {
    const char* light;
    const char* dark;
    const char* dashes = "1";  ///< gnuplot's dash type
    int point_type = 7;        ///< gnuplot's point type
};

constexpr std::size_t COLOUR_COUNT = 6;
constexpr Ink INK = {"#24292f", "#e6edf3"};
constexpr Ink MARK_INK = {"#57606a", "#9aa4af"};
constexpr Ink GRID_INK = {"#d8dee4", "#343b44"};
constexpr Ink PAPER = {"#ffffff", "#161b22"};

Ink ink_of(Colour colour);

/// Where the axes lie, in the viewBox, and what they span.
struct Geometry {
    double left = 0, top = 0, right = 0, bottom = 0;
    double x_min = 0, x_max = 0, y_min = 0, y_max = 0;
};

/// gnuplot's SVG made fit for a page: no XML prolog, every id led by the plot's name, a ground, colours that follow the
/// screen's light or dark scheme, the title for readers that cannot see, and the geometry as data- attributes.
/// Throws OutputError.
std::string themed_svg(std::string_view drawn, const Plot& plot, const Geometry& geometry);

}  // namespace clerestory::plot
