#pragma once

#include <string>
#include <vector>

/// Reads back what src/draw/plot.cpp draws, in the data's own units, so that tests can hold it against the numbers.
namespace clerestory::test {

struct Point {
    double x = 0, y = 0;
};

/// A curve as drawn: its line's vertices, or its points' centres.
struct DrawnCurve {
    std::string label;
    std::vector<Point> points;
};

struct SvgPlot {
    double left = 0, top = 0, right = 0, bottom = 0;    ///< of the axes, in the viewBox
    double x_min = 0, x_max = 0, y_min = 0, y_max = 0;  ///< that the axes span
    bool x_log = false, y_log = false;
    std::vector<DrawnCurve> curves = {};      ///< those with a label
    std::vector<double> vertical_marks = {};  ///< places of dashed lines from the bottom to the top
    std::vector<std::string> texts = {};      ///< every text as written, titles and ticks included

    /// Half of the last digit that the SVG writes, and gnuplot's own cut, in the units of a linear x or y.
    [[nodiscard]] double x_resolution() const;
    [[nodiscard]] double y_resolution() const;
    /// Throws std::runtime_error where there is none.
    [[nodiscard]] const DrawnCurve& curve(const std::string& label) const;
};

/// Throws std::runtime_error naming what is missing.
SvgPlot read_svg_plot(const std::string& svg);

}  // namespace clerestory::test
