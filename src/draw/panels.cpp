#include "draw/panels.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <span>
#include <string_view>

#include "base/text_escape.hpp"
#include "draw/colour_map.hpp"
#include "draw/plot_theme.hpp"
#include "image.hpp"
#include "map/png_text.hpp"

namespace clerestory {
namespace {

// Of the sheet, in the units of its viewBox; text is as high as in plots.
constexpr double SHEET_WIDTH = 720;
constexpr double MARGIN = 16;
constexpr double GAP = 14;
constexpr double TITLE_HEIGHT = 44;
constexpr double PANEL_TEXT = 46;
constexpr double BAR_HEIGHT = 14;
constexpr double BAR_BLOCK = 62;

std::string panel_png(const Panel& panel, double limit) {
    const auto bytes = coloured(panel.values, panel.map, limit);
    const auto png = png_bytes(panel.title, panel.size, panel.size, 4, bytes.data());
    return {png.begin(), png.end()};
}

std::string text_at(double x, double y, std::string_view anchor, std::string_view kind, const std::string& text) {
    return fmt::format("<text class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", kind, x, y,
                       anchor, escaped(text));
}

/// A scale bar with its label above and ticks below, `left` to `right` at `top`.
std::string scale_bar(const PanelSheet& sheet, ColourMap map, double left, double right, double top) {
    const bool diverging = map == ColourMap::diverging;
    const std::string id = fmt::format("{}_{}", sheet.name, diverging ? "diverging" : "sequential");
    constexpr int STOPS = 16;
    std::string out = fmt::format("<linearGradient id=\"{}\">", id);
    for (int k = 0; k <= STOPS; ++k) {
        const double share = static_cast<double>(k) / STOPS;
        const auto c = colour_at(map, diverging ? 2 * share - 1 : share);
        out += fmt::format("<stop offset=\"{}\" stop-color=\"#{:02x}{:02x}{:02x}\"/>", share, std::lround(c[0]),
                           std::lround(c[1]), std::lround(c[2]));
    }
    out += "</linearGradient>\n";
    out += text_at((left + right) / 2, top - 6, "middle", "label",
                   diverging ? sheet.diverging_label : sheet.sequential_label);
    out += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{}\" fill=\"url(#{})\" class=\"frame\"/>\n", left,
        top, right - left, BAR_HEIGHT, id);
    constexpr std::array<double, 5> PARTS = {-1, -0.25, 0, 0.25, 1};  // even steps of the root
    for (const double part : PARTS) {
        if (!diverging && part < 0) continue;
        const double place = colour_place(part);
        const double share = diverging ? (place + 1) / 2 : place;
        const double x = left + share * (right - left);
        const std::string sign = part > 0 && diverging ? "+" : part < 0 ? "−" : "";
        out += fmt::format("<path class=\"tick\" d=\"M{0:.1f} {1:.1f}v5\"/>\n", x, top + BAR_HEIGHT);
        out += text_at(x, top + BAR_HEIGHT + 19, "middle", "small", sign + tick_percent(std::abs(part) * sheet.limit));
    }
    return out;
}

std::string style(const std::string& name) {
    const auto rules = [&](const plot::Ink& ink, const plot::Ink& paper, bool dark) {
        const char* text = dark ? ink.dark : ink.light;
        return fmt::format("#{0} text{{fill:{1}}}#{0} .tick{{stroke:{1}}}#{0} .ground{{fill:{2}}}", name, text,
                           dark ? paper.dark : paper.light);
    };
    return fmt::format(
        "<style>#{0} text{{font-family:sans-serif;font-size:14px}}#{0} .small{{font-size:12px}}"
        "#{0} .label{{font-size:12px}}#{0} .frame{{stroke:{3};stroke-width:.5}}"
        "{1}@media screen and (prefers-color-scheme:dark){{{2}}}</style>\n",
        name, rules(plot::INK, plot::PAPER, false), rules(plot::INK, plot::PAPER, true), plot::MARK_INK.light);
}

}  // namespace

double round_limit(const std::vector<Panel>& panels) {
    std::vector<std::span<const float>> pictures;
    for (const auto& panel : panels) pictures.emplace_back(panel.values);
    return round_limit(pictures);
}

std::string panels_svg(const PanelSheet& sheet) {
    const auto columns = static_cast<double>(sheet.columns);
    const double side = (SHEET_WIDTH - 2 * MARGIN - (columns - 1) * GAP) / columns;
    const auto rows = (sheet.panels.size() + sheet.columns - 1) / sheet.columns;
    const double height = TITLE_HEIGHT + static_cast<double>(rows) * (side + PANEL_TEXT) + BAR_BLOCK + MARGIN;
    std::string body;
    std::set<ColourMap> maps;
    for (std::size_t i = 0; i < sheet.panels.size(); ++i) {
        const Panel& panel = sheet.panels[i];
        maps.insert(panel.map);
        const std::size_t column = i % sheet.columns;
        const std::size_t row = i / sheet.columns;
        const double x = MARGIN + static_cast<double>(column) * (side + GAP);
        const double y = TITLE_HEIGHT + static_cast<double>(row) * (side + PANEL_TEXT);
        body += fmt::format("<image x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" href=\"{}\"/>\n", x, y,
                            side, side, png_uri(panel_png(panel, sheet.limit)));
        body += text_at(x + side / 2, y + side + 17, "middle", "name", panel.title);
        body += text_at(x + side / 2, y + side + 34, "middle", "small", panel.note);
    }
    const double top = height - MARGIN - BAR_HEIGHT - 22;
    const auto bars = static_cast<double>(maps.size());
    const double length = (SHEET_WIDTH - 2 * MARGIN - (bars - 1) * 3 * MARGIN - 2 * MARGIN) / bars;
    double left = 2 * MARGIN;
    for (const ColourMap map : maps) {
        body += scale_bar(sheet, map, left, left + length, top);
        left += length + 3 * MARGIN;
    }
    return fmt::format(
               "<svg id=\"{0}\" class=\"clerestory-plot\" role=\"img\" aria-label=\"{1}\" viewBox=\"0 0 {2} {3:.0f}\" "
               "xmlns=\"http://www.w3.org/2000/svg\">\n<title>{1}</title>\n{4}"
               "<rect class=\"ground\" width=\"{2}\" height=\"{3:.0f}\" rx=\"8\"/>\n",
               sheet.name, escaped(sheet.title), SHEET_WIDTH, height, style(sheet.name)) +
           text_at(SHEET_WIDTH / 2, 26, "middle", "name", sheet.title) + body + "</svg>\n";
}

}  // namespace clerestory
