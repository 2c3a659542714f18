#include "page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "markup.hpp"

namespace clerestory {
namespace {

constexpr const char* NO_NUMBER = "—";

constexpr std::string_view STYLE = R"css(
:root{color-scheme:light dark;--ink:#24292f;--soft:#57606a;--line:#d8dee4;--paper:#fff;--card:#f6f8fa;--accent:#0072b2}
@media screen and (prefers-color-scheme:dark){
:root{--ink:#e6edf3;--soft:#9aa4af;--line:#343b44;--paper:#0d1117;--card:#161b22;--accent:#4aa8e8}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:var(--paper);color:var(--ink);font:16px/1.55 system-ui,sans-serif}
main{max-width:1120px;margin:0 auto;padding:24px 20px 64px}
header p,section>p,section>ul{max-width:46em}
h1{font-size:clamp(26px,4.4vw,40px);line-height:1.15;margin:12px 0 8px;letter-spacing:-.01em}
h2{font-size:clamp(20px,2.8vw,26px);line-height:1.25;margin:56px 0 8px;padding-top:20px;border-top:1px solid var(--line)}
h3{font-size:17px;line-height:1.3;margin:0 0 6px}
.lead{font-size:18px;color:var(--soft)}
nav{display:flex;flex-wrap:wrap;gap:4px 18px;font-size:15px;margin:12px 0 0}
a{color:var(--accent)}
.key{display:grid;grid-template-columns:repeat(auto-fit,minmax(210px,1fr));gap:12px;margin:20px 0 0;padding:0;list-style:none}
.key li{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:12px 14px;font-size:14px;color:var(--soft)}
.key b{display:block;font-size:24px;line-height:1.3;color:var(--ink);font-weight:650}
figure{margin:20px 0;display:grid;grid-template-columns:minmax(0,1fr);gap:14px;background:var(--card);
border:1px solid var(--line);border-radius:12px;padding:16px}
figure>*{min-width:0}
.picture svg,.picture img{display:block;width:100%;height:auto;border-radius:8px}
.sphere img,.pair img{max-width:511px;margin:0 auto}
.pair .picture{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,240px),1fr));gap:14px}
.note{margin:6px 0 0;text-align:center;font-size:14px;color:var(--soft)}
pre+pre{margin-top:6px}
figcaption p{margin:0 0 10px}
dl{display:grid;grid-template-columns:auto auto;justify-content:start;gap:2px 18px;margin:0 0 12px;font-size:15px}
dt{color:var(--soft)}
dd{margin:0;font-variant-numeric:tabular-nums}
pre{margin:0;padding:9px 12px;background:var(--paper);border:1px solid var(--line);border-radius:8px;
font:13px/1.5 ui-monospace,monospace;white-space:pre-wrap;overflow-wrap:anywhere}
pre span{display:inline-block;max-width:100%}
.scroll{overflow-x:auto;margin:16px 0;border:1px solid var(--line);border-radius:10px}
table{border-collapse:collapse;width:100%;font-size:14px;font-variant-numeric:tabular-nums}
caption{text-align:left;padding:10px 12px;color:var(--soft)}
th,td{padding:6px 12px;text-align:right;border-top:1px solid var(--line);white-space:nowrap}
th{font-weight:600;background:var(--card);white-space:normal;vertical-align:bottom}
th:first-child,td:first-child{text-align:left}
details summary{cursor:pointer;color:var(--accent);padding:6px 0}
footer{margin-top:48px;padding-top:16px;border-top:1px solid var(--line);color:var(--soft);font-size:14px;overflow-wrap:anywhere}
@media (min-width:860px){
figure:not(.wide){grid-template-columns:minmax(0,1.5fr) minmax(0,1fr);gap:24px;padding:20px;align-items:center}
figure.sphere:not(.wide){grid-template-columns:minmax(0,420px) minmax(0,1fr)}}
@media (max-width:600px){
main{padding:16px 12px 48px}figure{padding:10px}figcaption{padding:0 4px 4px}
.picture svg text{font-size:17px!important}.picture svg text.small,.picture svg text.label{font-size:15px!important}}
@media print{
body{font-size:9pt;line-height:1.4}dl{font-size:9pt}h3{font-size:10.5pt}main{max-width:none;padding:0}nav{display:none}
h2{margin-top:24px;break-after:avoid}section>p{break-after:avoid;break-inside:avoid}figure,tr,.key li{break-inside:avoid}
figure{margin:12px 0;padding:10px}figure:not(.wide){grid-template-columns:minmax(0,1.2fr) minmax(0,1fr)}
.key{grid-template-columns:repeat(4,1fr)}.pair .picture{grid-template-columns:1fr 1fr}pre{font-size:8pt}
.scroll{overflow:visible}th,td{padding:3px 5px;font-size:8.5pt;white-space:normal}}
)css";

const nlohmann::json* find(const nlohmann::json& report, const std::string& key) {
    const nlohmann::json::json_pointer pointer(key);
    return report.contains(pointer) ? &report.at(pointer) : nullptr;
}

std::string keyed(const std::string& key, double factor, const std::string& shown, std::string_view unit) {
    const std::string scaled = factor == 1 ? "" : fmt::format(" data-factor=\"{}\"", factor);
    const std::string after = unit.empty() ? "" : fmt::format("&#8239;{}", unit);
    return fmt::format("<span data-key=\"{}\"{}>{}</span>{}", escaped(key), scaled, shown, after);
}

/// With a minus sign, which is as wide as a plus, in place of the hyphen.
std::string typographic(std::string number) {
    if (number.starts_with('-')) number.replace(0, 1, "−");
    return number;
}

/// Each word unbroken where it fits in a line.
std::string command_html(const std::string& command) {
    std::string out = "<span>";
    for (const char c : escaped(command)) out += c == ' ' ? std::string("</span> <span>") : std::string(1, c);
    return out + "</span>";
}

/// Three significant digits without an exponent where that is short.
std::string three_digits(double value) {
    const double size = std::abs(value);
    if (size == 0) return "0";
    if (size < 1e-4 || size >= 1e6) return typographic(fmt::format("{:.2e}", value));
    const int whole_digits = static_cast<int>(std::floor(std::log10(size))) + 1;
    return typographic(fmt::format("{:.{}f}", value, std::max(3 - whole_digits, 0)));
}

}  // namespace

int decimals_of_error(double error) {
    constexpr int MOST = 9;
    if (!(error > 0)) return MOST;
    return std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, MOST);
}

std::string PageNumbers::number(const std::string& key, double factor, std::string_view unit) const {
    const auto* value = find(report_, key);
    if (value == nullptr || !value->is_number()) return NO_NUMBER;
    return keyed(key, factor, three_digits(factor * value->get<double>()), unit);
}

std::string PageNumbers::signed_percent(const std::string& key) const {
    constexpr double PERCENT = 100;
    const auto* value = find(report_, key);
    if (value == nullptr || !value->is_number()) return NO_NUMBER;
    const double shown = PERCENT * value->get<double>();
    return keyed(key, PERCENT, fmt::format("{}{}", shown > 0 ? "+" : "", three_digits(shown)), "%");
}

std::string PageNumbers::seconds(const std::string& key) const {
    constexpr double MILLISECONDS = 1000;
    const auto* value = find(report_, key);
    if (value == nullptr || !value->is_number()) return NO_NUMBER;
    return value->get<double>() < 1 ? number(key, MILLISECONDS, "ms") : number(key, 1, "s");
}

std::string PageNumbers::whole(const std::string& key) const {
    const auto* value = find(report_, key);
    if (value == nullptr || !value->is_number()) return NO_NUMBER;
    return keyed(key, 1, value->is_number_float() ? fmt::format("{}", value->get<double>()) : value->dump(), "");
}

std::string PageNumbers::fixed(const std::string& key, int decimals, std::string_view unit) const {
    const auto* value = find(report_, key);
    if (value == nullptr || !value->is_number()) return NO_NUMBER;
    return keyed(key, 1, typographic(fmt::format("{:.{}f}", value->get<double>(), decimals)), unit);
}

std::string PageNumbers::with_error(const std::string& key, const std::string& error_key) const {
    const auto* error = find(report_, error_key);
    if (error == nullptr || !error->is_number()) return NO_NUMBER;
    const int decimals = decimals_of_error(error->get<double>());
    return fmt::format("{} ± {}", fixed(key, decimals), fixed(error_key, decimals));
}

std::string PageNumbers::text(const std::string& key) const {
    const auto* value = find(report_, key);
    return value != nullptr && value->is_string() ? escaped(value->get<std::string>()) : NO_NUMBER;
}

std::string figure_html(const FigureBlock& figure) {
    std::string pictures;
    for (const auto& shown : figure.pictures) {
        const bool is_svg = shown.picture.starts_with("<svg");
        const std::string note = shown.note.empty() ? "" : fmt::format("<p class=\"note\">{}</p>", shown.note);
        pictures += is_svg ? fmt::format("<div>{}{}</div>", shown.picture, note)
                           : fmt::format("<div><img alt=\"{}\" src=\"{}\">{}</div>", escaped(shown.alt),
                                         png_uri(shown.picture), note);
    }
    std::string numbers;
    for (const auto& [name, value] : figure.numbers) numbers += fmt::format("<dt>{}</dt><dd>{}</dd>", name, value);
    std::string commands;
    for (const auto& command : figure.commands) commands += fmt::format("<pre>{}</pre>", command_html(command));
    const std::string list = numbers.empty() ? "" : fmt::format("<dl>{}</dl>", numbers);
    return fmt::format(
        "<figure id=\"about_{}\" class=\"{}\">\n<div class=\"picture\">{}</div>\n"
        "<figcaption><h3>{}</h3><p>{}</p>{}{}</figcaption>\n</figure>\n",
        figure.id, figure.shape, pictures, figure.title, figure.caption, list, commands);
}

std::string table_html(const std::string& caption, const std::vector<std::string>& head,
                       const std::vector<std::vector<std::string>>& rows) {
    std::string out = fmt::format("<div class=\"scroll\"><table><caption>{}</caption><thead><tr>", caption);
    for (const auto& cell : head) out += fmt::format("<th scope=\"col\">{}</th>", cell);
    out += "</tr></thead><tbody>\n";
    for (const auto& row : rows) {
        out += "<tr>";
        for (const auto& cell : row) out += fmt::format("<td>{}</td>", cell);
        out += "</tr>\n";
    }
    return out + "</tbody></table></div>\n";
}

std::string page_html(const std::string& title, const std::string& body) {
    return fmt::format(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
        "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n"
        "<style>{}</style>\n</head>\n<body>\n<main>\n{}</main>\n</body>\n</html>\n",
        escaped(title), STYLE, body);
}

}  // namespace clerestory
