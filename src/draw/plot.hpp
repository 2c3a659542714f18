#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

/// Plots described as data and drawn by gnuplot, which runs as a child process.
namespace clerestory::plot {

/// Colours that people with any common colour blindness tell apart, on white and on the dark page's ground.
/// Source: Okabe and Ito, Color universal design, 2008; its yellow is left out, because it vanishes on white.
enum class Colour { blue, vermillion, green, purple, orange, sky };

enum class Style { line, points, line_with_points };

struct Axis {
    std::string title = {};
    std::string unit = {};                     ///< written in brackets after the title; empty for pure numbers
    std::optional<double> min = {}, max = {};  ///< the data's own without
    std::optional<double> tick_step = {};
    bool logarithmic = false;
    std::string tick_format = {};  ///< as gnuplot writes it; empty: plain numbers, powers of ten on a logarithmic axis
};

/// y against x; points that are not finite are left out.
///   x, y       [n]
///   low, high  [n]  ends of error bars; both empty for none
struct Curve {
    std::string label;  ///< in the legend; empty: not listed there
    std::vector<double> x, y;
    Style style = Style::line;
    std::vector<double> low = {}, high = {};
    std::optional<Colour> colour =
        {};  ///< the next one of the palette without; each colour has its own dashes and marks
};

/// A shaded area between two curves.
struct Band {
    std::string label;
    std::vector<double> x, low, high;
    Colour colour = Colour::sky;
};

enum class Direction { vertical, horizontal };
enum class Side { before, after };  ///< left or right of a vertical line, below or above a horizontal one

/// A dashed line across the plot, and its label along it.
struct Mark {
    double at = 0;
    std::string label;
    Direction direction = Direction::vertical;
    Side side = Side::before;
};

/// A text beside a point.
struct Note {
    double x = 0, y = 0;
    std::string text;
};

struct Plot {
    std::string name;  ///< letters, digits, - and _; leads every id in the SVG, so that many plots fit in one page
    std::string title;
    Axis x, y;
    std::vector<Curve> curves;
    std::vector<Band> bands = {};
    std::vector<Mark> marks = {};
    std::vector<Note> notes = {};
    unsigned width = 720;  ///< of the viewBox, in pixels; text is 14 of them high
    unsigned height = 460;
};

/// The plot as SVG that starts with its <svg> element, so that it is a file and a part of an HTML page alike. It has a
/// viewBox and no fixed size, and changes its colours on a dark screen. Its data- attributes tell where data lie:
/// data-box "left top right bottom" in the viewBox, data-x-range and data-y-range "min max", data-x-scale and
/// data-y-scale "linear" or "log"; the i-th of `bands` and `curves` (from 1) is the group NAME_plot_i. Throws
/// OutputError.
std::string svg(const Plot& plot);

/// The plot as PNG, at twice the viewBox's size. Throws OutputError.
std::string png(const Plot& plot);

/// Writes .svg or .png by suffix, whole or not at all. Throws UsageError for another suffix, OutputError.
void write(const std::filesystem::path& file, const Plot& plot);

}  // namespace clerestory::plot
