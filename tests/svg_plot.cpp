#include "svg_plot.hpp"

#include <cmath>
#include <regex>
#include <sstream>
#include <stdexcept>

namespace clerestory::test {
namespace {

/// gnuplot counts in hundredths of a pixel and cuts; the axes' ends are cut too.
constexpr double PIXEL_RESOLUTION = 0.02;

std::vector<double> numbers(const std::string& svg, const std::string& attribute) {
    const auto lead = attribute + "=\"";
    const auto at = svg.find(lead);
    if (at == std::string::npos) throw std::runtime_error("the SVG has no " + attribute);
    const auto start = at + lead.size();
    std::istringstream stream(svg.substr(start, svg.find('"', start) - start));
    std::vector<double> values;
    for (double value = 0; stream >> value;) values.push_back(value);
    return values;
}

double along(double share, double min, double max, bool logarithmic) {
    if (logarithmic) return min * std::pow(max / min, share);
    return min + share * (max - min);
}

Point to_data(const SvgPlot& plot, Point pixel) {
    return {along((pixel.x - plot.left) / (plot.right - plot.left), plot.x_min, plot.x_max, plot.x_log),
            along((plot.bottom - pixel.y) / (plot.bottom - plot.top), plot.y_min, plot.y_max, plot.y_log)};
}

bool inside(const SvgPlot& plot, Point p) {
    return p.x >= plot.left - PIXEL_RESOLUTION && p.x <= plot.right + PIXEL_RESOLUTION &&
           p.y >= plot.top - PIXEL_RESOLUTION && p.y <= plot.bottom + PIXEL_RESOLUTION;
}

std::string unescaped(std::string text) {
    const std::pair<const char*, const char*> entities[] = {
        {"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&amp;", "&"}};
    for (const auto& [from, to] : entities) text = std::regex_replace(text, std::regex(from), to);
    return text;
}

/// The numbers of every path in `group`; what lies outside the axes is the legend's.
std::vector<Point> pixels_of_lines(const std::string& group) {
    std::vector<Point> points;
    for (auto at = group.find(" d='"); at != std::string::npos; at = group.find(" d='", at + 1)) {
        const auto start = at + 4;
        std::istringstream path(group.substr(start, group.find('\'', start) - start));
        char command = 0;
        char comma = 0;
        for (Point p; path >> command >> p.x >> comma >> p.y;) points.push_back(p);
    }
    return points;
}

std::vector<Point> pixels_of_points(const std::string& group) {
    std::vector<Point> points;
    static const std::regex place("<use [^>]*translate\\(([0-9.]+),([0-9.]+)\\)");
    for (std::sregex_iterator it(group.begin(), group.end(), place), end; it != end; ++it) {
        points.push_back({std::stod((*it)[1]), std::stod((*it)[2])});
    }
    return points;
}

/// The group that opens at `start`, to its own end.
std::string group_from(const std::string& svg, std::size_t start) {
    int depth = 0;
    for (auto at = start; at != std::string::npos; at = svg.find('<', at + 1)) {
        depth += svg.compare(at, 3, "<g ") == 0 ? 1 : svg.compare(at, 4, "</g>") == 0 ? -1 : 0;
        if (depth == 0) return svg.substr(start, at - start);
    }
    throw std::runtime_error("a group of the SVG does not end");
}

void read_curves(const std::string& svg, SvgPlot& plot) {
    static const std::regex opening("<g id=\"[A-Za-z0-9_-]+_plot_[0-9]+\" ><title>([^<]*)</title>");
    const std::sregex_iterator end;
    for (std::sregex_iterator it(svg.begin(), svg.end(), opening); it != end; ++it) {
        const auto start = static_cast<std::size_t>(it->position());
        const std::string group = group_from(svg, start);
        auto pixels = pixels_of_points(group);
        if (pixels.empty()) pixels = pixels_of_lines(group);
        DrawnCurve curve{unescaped((*it)[1]), {}};
        for (const auto& pixel : pixels) {
            if (inside(plot, pixel)) curve.points.push_back(to_data(plot, pixel));
        }
        plot.curves.push_back(std::move(curve));
    }
}

/// Dashed lines straight from the bottom of the axes to their top; one path may hold several.
void read_marks(const std::string& svg, SvgPlot& plot) {
    static const std::regex dashed("stroke-dasharray='[^']*'\\s+d='[^']*'");
    const std::sregex_iterator end;
    for (std::sregex_iterator it(svg.begin(), svg.end(), dashed); it != end; ++it) {
        const auto points = pixels_of_lines(it->str());
        for (std::size_t i = 1; i < points.size(); ++i) {
            const bool whole = std::abs(points[i - 1].y - plot.bottom) <= PIXEL_RESOLUTION &&
                               std::abs(points[i].y - plot.top) <= PIXEL_RESOLUTION;
            if (whole && points[i].x == points[i - 1].x) plot.vertical_marks.push_back(to_data(plot, points[i]).x);
        }
    }
}

void read_texts(const std::string& svg, SvgPlot& plot) {
    static const std::regex text("<text>(.*?)</text>");
    static const std::regex tag("<[^>]*>");
    const std::sregex_iterator end;
    for (std::sregex_iterator it(svg.begin(), svg.end(), text); it != end; ++it) {
        plot.texts.push_back(unescaped(std::regex_replace((*it)[1].str(), tag, "")));
    }
}

}  // namespace

double SvgPlot::x_resolution() const { return PIXEL_RESOLUTION * (x_max - x_min) / (right - left); }
double SvgPlot::y_resolution() const { return PIXEL_RESOLUTION * (y_max - y_min) / (bottom - top); }

const DrawnCurve& SvgPlot::curve(const std::string& label) const {
    for (const auto& curve : curves) {
        if (curve.label == label) return curve;
    }
    throw std::runtime_error("the SVG has no curve '" + label + "'");
}

SvgPlot read_svg_plot(const std::string& svg) {
    const auto box = numbers(svg, "data-box");
    const auto x = numbers(svg, "data-x-range");
    const auto y = numbers(svg, "data-y-range");
    if (box.size() != 4 || x.size() != 2 || y.size() != 2) throw std::runtime_error("the SVG's geometry is not whole");
    SvgPlot plot{box[0], box[1], box[2], box[3], x[0], x[1], y[0], y[1]};
    plot.x_log = svg.find("data-x-scale=\"log\"") != std::string::npos;
    plot.y_log = svg.find("data-y-scale=\"log\"") != std::string::npos;
    read_curves(svg, plot);
    read_marks(svg, plot);
    read_texts(svg, plot);
    return plot;
}

}  // namespace clerestory::test
