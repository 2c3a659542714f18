#include "draw/plot_theme.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdio>

#include "base/text_escape.hpp"
#include "error.hpp"

namespace clerestory::plot {
namespace {

constexpr std::array<Ink, COLOUR_COUNT> PALETTE = {{
    {"#0072b2", "#4aa8e8", "1", 7},            // blue, solid, disc
    {"#d55e00", "#f08a3c", "(14,5)", 5},       // vermillion, dashes, square
    {"#009e73", "#2cc79a", "(3,4)", 9},        // green, dots, triangle
    {"#cc79a7", "#dd93ba", "(14,4,3,4)", 13},  // purple, dash and dot, diamond
    {"#e69f00", "#e9b13a", "(8,4)", 11},       // orange, short dashes, triangle on its tip
    {"#56b4e9", "#7cc7f2", "(20,4)", 15},      // sky, long dashes, pentagon
}};

void replace_all(std::string& text, std::string_view from, std::string_view to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size()) {
        text.replace(at, from.size(), to);
    }
}

/// gnuplot writes one colour as rgb(  0, 114, 178), rgb(0,114,178), black or white; all become #rrggbb.
std::string with_hex_colours(std::string_view text) {
    constexpr std::string_view LEAD = "rgb(";
    std::string out;
    while (true) {
        const auto at = text.find(LEAD);
        out += text.substr(0, at);
        if (at == std::string_view::npos) break;
        text.remove_prefix(at);
        unsigned r = 0;
        unsigned g = 0;
        unsigned b = 0;
        const std::string head(text.substr(0, text.find(')') + 1));
        const bool read = std::sscanf(head.c_str(), "rgb(%u ,%u ,%u", &r, &g, &b) == 3;
        out += read ? fmt::format("#{:02x}{:02x}{:02x}", r, g, b) : head;
        text.remove_prefix(head.size());
    }
    for (const char quote : {'"', '\''}) {
        replace_all(out, fmt::format("={0}black{0}", quote), fmt::format("={0}{1}{0}", quote, INK.light));
        replace_all(out, fmt::format("={0}unit_albedo_radiance{0}", quote),
                    fmt::format("={0}{1}{0}", quote, PAPER.light));
    }
    replace_all(out, "fill = '", "fill='");
    return out;
}

/// gnuplot opens and closes groups that hold nothing; a third of a small plot is made of them.
void drop_empty_groups(std::string& text) {
    for (std::size_t at = 0; (at = text.find("<g ", at)) != std::string::npos;) {
        const auto end = text.find('>', at);
        const auto next = text.find_first_not_of(" \t\n", end + 1);
        if (next != std::string::npos && text.compare(next, 4, "</g>") == 0) {
            text.erase(at, next + 4 - at);
        } else {
            at = end;
        }
    }
}

/// Rules for dark screens only: elsewhere, and in viewers without CSS, the attributes as drawn are right.
std::string dark_rules(const std::string& name) {
    std::string rules;
    const auto add = [&](const Ink& ink) {
        for (const char* property : {"stroke", "fill", "color"}) {
            rules += fmt::format("#{0} [{1}=\"{2}\"]{{{1}:{3}}}", name, property, ink.light, ink.dark);
        }
    };
    for (const auto& ink : PALETTE) add(ink);
    for (const auto& ink : {INK, MARK_INK, GRID_INK, PAPER}) add(ink);
    return fmt::format("<style>@media screen and (prefers-color-scheme:dark){{{}}}</style>", rules);
}

const char* scale_of(const Axis& axis) { return axis.logarithmic ? "log" : "linear"; }

std::string opening(const Plot& plot, std::string_view view_box, const Geometry& g) {
    const auto title = escaped(plot.title);
    return fmt::format(
               "<svg id=\"{}\" class=\"clerestory-plot\" role=\"img\" aria-label=\"{}\" viewBox=\"{}\" "
               "xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" ",
               plot.name, title, view_box) +
           fmt::format("data-box=\"{:.2f} {:.2f} {:.2f} {:.2f}\" data-x-range=\"{} {}\" data-y-range=\"{} {}\" ",
                       g.left, g.top, g.right, g.bottom, g.x_min, g.x_max, g.y_min, g.y_max) +
           fmt::format("data-x-scale=\"{}\" data-y-scale=\"{}\">\n<title>{}</title>\n{}\n", scale_of(plot.x),
                       scale_of(plot.y), title, dark_rules(plot.name));
}

/// The text between `before` and `after`, both searched from the start. Throws OutputError.
std::string_view between(std::string_view text, std::string_view before, std::string_view after) {
    const auto start = text.find(before);
    const auto end = start == std::string_view::npos ? start : text.find(after, start + before.size());
    if (end == std::string_view::npos) {
        throw OutputError(fmt::format("gnuplot's SVG has no {}: this version writes another form than 5.4", before));
    }
    return text.substr(start + before.size(), end - start - before.size());
}

}  // namespace

Ink ink_of(Colour colour) { return PALETTE.at(static_cast<std::size_t>(colour)); }

std::string themed_svg(std::string_view drawn, const Plot& plot, const Geometry& geometry) {
    const auto view_box = between(drawn, "viewBox=\"", "\"");
    const auto canvas = drawn.find("<g id=\"gnuplot_canvas\">");
    if (canvas == std::string_view::npos) {
        throw OutputError("gnuplot's SVG has no canvas: this version writes another form than 5.4");
    }
    std::string body = with_hex_colours(drawn.substr(canvas));
    drop_empty_groups(body);
    const auto ground = fmt::format("fill=\"{}\" rx=\"8\"", PAPER.light);
    replace_all(body, "fill=\"none\"/>\n<defs>", ground + "/>\n<defs>");
    for (const char quote : {'"', '\''}) {
        for (const char* id : {"gnuplot_canvas", "gpDot", "gpPt", "textbox", "greybox"}) {
            replace_all(body, fmt::format("id={}{}", quote, id), fmt::format("id={}{}_{}", quote, plot.name, id));
            replace_all(body, fmt::format("xlink:href={}#{}", quote, id),
                        fmt::format("xlink:href={}#{}_{}", quote, plot.name, id));
        }
    }
    return opening(plot, view_box, geometry) + body;
}

}  // namespace clerestory::plot
