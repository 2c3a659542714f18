#include "draw/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>

#include "base/atomic_file.hpp"
#include "base/text_escape.hpp"
#include "draw/gnuplot.hpp"
#include "draw/plot_theme.hpp"
#include "error.hpp"

namespace clerestory::plot {
namespace {

enum class Terminal { svg, png };

constexpr unsigned PNG_SCALE = 2;
/// Leads the line in which the script tells where the axes ended up.
constexpr const char* GEOMETRY_TAG = "clerestory-geometry";

std::string titled(const Axis& axis) {
    return axis.unit.empty() ? axis.title : fmt::format("{} [{}]", axis.title, axis.unit);
}

std::string limit(const std::optional<double>& value) { return value ? fmt::format("{}", *value) : "*"; }

std::string axis_script(char letter, const Axis& axis) {
    std::string out = fmt::format("set {}label {} noenhanced\nset {}range [{}:{}]\n", letter, quoted(titled(axis)),
                                  letter, limit(axis.min), limit(axis.max));
    if (axis.tick_step) out += fmt::format("set {}tics {}\n", letter, *axis.tick_step);
    if (axis.logarithmic) out += fmt::format("set logscale {} 10\n", letter);
    const char* automatic = axis.logarithmic ? "10^{%T}" : "%g";
    out += fmt::format("set format {} {}\n", letter, quoted(axis.tick_format.empty() ? automatic : axis.tick_format));
    return out;
}

bool drawable(const Axis& axis, double value) { return std::isfinite(value) && (!axis.logarithmic || value > 0); }

/// `columns` side by side as a gnuplot data block; rows that cannot be drawn break the line.
std::string data_block(const std::string& name, const Plot& plot,
                       const std::vector<const std::vector<double>*>& columns) {
    std::string out = fmt::format("${} << EOD\n", name);
    std::size_t drawn = 0;
    for (std::size_t row = 0; row < columns[0]->size(); ++row) {
        std::string line;
        bool good = true;
        for (const auto* column : columns) {
            good = good && drawable(column == columns[0] ? plot.x : plot.y, (*column)[row]);
            line += fmt::format("{} ", (*column)[row]);
        }
        drawn += good ? 1 : 0;
        out += good ? line + "\n" : "\n";
    }
    if (drawn == 0) throw OutputError(fmt::format("plot {}: a curve has no point that can be drawn", plot.name));
    return out + "EOD\n";
}

void check_lengths(const Plot& plot, const std::string& label, std::initializer_list<std::size_t> lengths) {
    if (std::adjacent_find(lengths.begin(), lengths.end(), std::not_equal_to<>()) == lengths.end()) return;
    throw OutputError(fmt::format("plot {}: the arrays of curve '{}' differ in length", plot.name, label));
}

std::string key_title(const std::string& label) {
    return label.empty() ? "notitle" : fmt::format("title {} noenhanced", quoted(label));
}

/// Data blocks and the elements of the plot command, in the order of drawing.
struct Layers {
    std::string data;
    std::vector<std::string> elements;
};

void add_band(const Plot& plot, const Band& band, Layers& layers) {
    check_lengths(plot, band.label, {band.x.size(), band.low.size(), band.high.size()});
    const auto name = fmt::format("data_{}", layers.elements.size());
    layers.data += data_block(name, plot, {&band.x, &band.low, &band.high});
    layers.elements.push_back(
        fmt::format("${} using 1:2:3 with filledcurves fc rgb '{}' fs transparent solid 0.25 noborder {}", name,
                    ink_of(band.colour).light, key_title(band.label)));
}

void add_curve(const Plot& plot, const Curve& curve, std::size_t index, Layers& layers) {
    const auto colour = curve.colour.value_or(static_cast<Colour>(index % COLOUR_COUNT));
    const auto look = ink_of(colour);
    const bool bars = !curve.low.empty() || !curve.high.empty();
    std::vector<const std::vector<double>*> columns = {&curve.x, &curve.y};
    check_lengths(plot, curve.label, {curve.x.size(), curve.y.size()});
    if (bars) {
        check_lengths(plot, curve.label, {curve.x.size(), curve.low.size(), curve.high.size()});
        columns.insert(columns.end(), {&curve.low, &curve.high});
    }
    const auto name = fmt::format("data_{}", layers.elements.size());
    layers.data += data_block(name, plot, columns);
    const std::string line = fmt::format("lc rgb '{}' lw 2", look.light);
    const std::string points = fmt::format("pt {} ps 0.8", look.point_type);
    std::string with;
    if (bars) {
        with = curve.style == Style::points ? "yerrorbars" : "yerrorlines";
    } else {
        with = curve.style == Style::line ? "lines" : curve.style == Style::points ? "points" : "linespoints";
    }
    std::string element = fmt::format("${} using {} with {} {}", name, bars ? "1:2:3:4" : "1:2", with, line);
    if (with != "lines") element += " " + points;
    if (with != "points" && with != "yerrorbars") element += fmt::format(" dt {}", look.dashes);
    layers.elements.push_back(element + " " + key_title(curve.label));
}

std::string mark_script(const Mark& mark) {
    const bool vertical = mark.direction == Direction::vertical;
    const auto place = [&](const std::string& along) {
        return vertical ? fmt::format("first {}, graph {}", mark.at, along)
                        : fmt::format("graph {}, first {}", along, mark.at);
    };
    // gnuplot centres a rotated text a little left of its place.
    const char* sideways = mark.side == Side::before ? "-1" : "1.4";
    const char* sign = mark.side == Side::before ? "-" : "";
    const auto offset = vertical ? fmt::format("rotate by 90 offset character {},0", sideways)
                                 : fmt::format("offset character 0,{}0.6", sign);
    return fmt::format("set arrow from {} to {} nohead lc rgb '{}' lw 1.5 dt (4,4) front\n", place("0"), place("1"),
                       MARK_INK.light) +
           fmt::format("set label {} at {} right {} noenhanced front\n", quoted(mark.label), place("0.98"), offset);
}

std::string terminal_script(const Plot& plot, Terminal terminal) {
    if (terminal == Terminal::svg) {
        return fmt::format("set terminal svg size {},{} dynamic font 'sans-serif,14' name '{}'\n", plot.width,
                           plot.height, plot.name);
    }
    return fmt::format(
        "set terminal pngcairo size {},{} font 'sans-serif,14' fontscale {} linewidth {} pointscale {}\n",
        PNG_SCALE * plot.width, PNG_SCALE * plot.height, 0.75 * PNG_SCALE, PNG_SCALE, PNG_SCALE);
}

std::string script(const Plot& plot, Terminal terminal) {
    Layers layers;
    for (const auto& band : plot.bands) add_band(plot, band, layers);
    for (std::size_t i = 0; i < plot.curves.size(); ++i) add_curve(plot, plot.curves[i], i, layers);
    if (layers.elements.empty()) throw OutputError(fmt::format("plot {}: nothing to draw", plot.name));
    std::string out = "set encoding utf8\nset minussign\n" + terminal_script(plot, terminal);
    out += fmt::format("set title {} noenhanced\n", quoted(plot.title));
    out += "set key tmargin center horizontal Left reverse samplen 3\n";  // above the axes: it can't cover a curve
    out += fmt::format("set border 3 lc rgb '{0}'\nset tics nomirror out textcolor rgb '{0}'\n", INK.light);
    out += fmt::format("set grid lc rgb '{}' lt 1 lw 1\n", GRID_INK.light);
    out += axis_script('x', plot.x) + axis_script('y', plot.y);
    for (const auto& mark : plot.marks) out += mark_script(mark);
    for (const auto& note : plot.notes) {
        out += fmt::format("set label {} at first {}, first {} left offset character 0.8,0.4 noenhanced front\n",
                           quoted(note.text), note.x, note.y);
    }
    out += layers.data + "plot " + fmt::format("{}", fmt::join(layers.elements, ", ")) + "\n";
    for (const char* value : {"TERM_XMIN", "TERM_XMAX", "TERM_YMIN", "TERM_YMAX", "X_MIN", "X_MAX", "Y_MIN", "Y_MAX"}) {
        out += fmt::format("print sprintf('{} %.17g', GPVAL_{})\n", GEOMETRY_TAG, value);
    }
    return out;
}

/// The numbers that the script printed, in the script's order. Throws OutputError.
Geometry geometry_of(const std::string& messages, const Plot& plot) {
    std::array<double, 8> values{};
    std::size_t at = 0;
    for (double& value : values) {
        at = messages.find(GEOMETRY_TAG, at);
        if (at == std::string::npos) {
            throw OutputError(fmt::format("plot {}: gnuplot did not finish: {}", plot.name, messages));
        }
        at += std::string_view(GEOMETRY_TAG).size();
        value = std::stod(messages.substr(at, 40));  // a printed double is shorter than 40 characters
    }
    const auto height = static_cast<double>(plot.height);
    return {values[0], height - values[3], values[1], height - values[2], values[4], values[5], values[6], values[7]};
}

void check_name(const std::string& name) {
    const auto good = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
    };
    if (!name.empty() && std::all_of(name.begin(), name.end(), good)) return;
    throw OutputError(fmt::format("plot name '{}': letters, digits, - and _ only, because ids are made of it", name));
}

}  // namespace

std::string svg(const Plot& plot) {
    check_name(plot.name);
    const auto drawing = run_gnuplot(script(plot, Terminal::svg));
    return themed_svg(drawing.output, plot, geometry_of(drawing.messages, plot));
}

std::string png(const Plot& plot) {
    check_name(plot.name);
    const auto drawing = run_gnuplot(script(plot, Terminal::png));
    (void)geometry_of(drawing.messages, plot);  // a script that stopped half-way prints none
    return drawing.output;
}

void write(const std::filesystem::path& file, const Plot& plot) {
    const std::string suffix = suffix_of(file);
    if (suffix != ".svg" && suffix != ".png") {
        throw UsageError(fmt::format("{}: a plot is written as .svg or .png", file.string()));
    }
    write_text(file, suffix == ".svg" ? svg(plot) : png(plot));
}

}  // namespace clerestory::plot
