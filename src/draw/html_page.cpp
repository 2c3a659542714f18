#include "draw/html_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "base/text_escape.hpp"
#include "draw/page_texts.hpp"

namespace clerestory {
namespace {

constexpr const char* NO_NUMBER = "—";
constexpr double PERCENT = 100;

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

double number_at(const nlohmann::json& report, const std::string& key) {
    const auto* value = find(report, key);
    return value != nullptr && value->is_number() ? value->get<double>() : std::numeric_limits<double>::quiet_NaN();
}

std::string number(const nlohmann::json& report, const std::string& key, double factor = 1,
                   std::string_view unit = "") {
    const double value = number_at(report, key);
    return std::isnan(value) ? NO_NUMBER : keyed(key, factor, three_digits(factor * value), unit);
}

std::string signed_percent(const nlohmann::json& report, const std::string& key) {
    const double shown = PERCENT * number_at(report, key);
    return std::isnan(shown) ? NO_NUMBER : keyed(key, PERCENT, (shown > 0 ? "+" : "") + three_digits(shown), "%");
}

std::string seconds(const nlohmann::json& report, const std::string& key) {
    constexpr double MILLISECONDS = 1000;
    return number_at(report, key) < 1 ? number(report, key, MILLISECONDS, "ms") : number(report, key, 1, "s");
}

std::string whole(const nlohmann::json& report, const std::string& key) {
    const auto* value = find(report, key);
    if (value == nullptr || !value->is_number()) return NO_NUMBER;
    return keyed(key, 1, value->is_number_float() ? fmt::format("{}", value->get<double>()) : value->dump(), "");
}

std::string fixed(const nlohmann::json& report, const std::string& key, int decimals, std::string_view unit = "") {
    const double value = number_at(report, key);
    return std::isnan(value) ? NO_NUMBER : keyed(key, 1, typographic(fmt::format("{:.{}f}", value, decimals)), unit);
}

std::string with_error(const nlohmann::json& report, const std::string& key, const std::string& error_key) {
    const double error = number_at(report, error_key);
    if (std::isnan(error)) return NO_NUMBER;
    const int decimals = decimals_of_error(error);
    return fmt::format("{} ± {}", fixed(report, key, decimals), fixed(report, error_key, decimals));
}

std::string text(const nlohmann::json& report, const std::string& key) {
    const auto* value = find(report, key);
    return value != nullptr && value->is_string() ? escaped(value->get<std::string>()) : NO_NUMBER;
}

PageTemplate::Words words_of(std::string_view field) {
    std::istringstream in{std::string(field)};
    return {std::istream_iterator<std::string>(in), std::istream_iterator<std::string>()};
}

/// Where the block that begins at the start of `text` ends: the place of its {{end}}.
std::size_t end_of_block(std::string_view text, const std::function<bool(const std::string&)>& is_block) {
    std::size_t depth = 1;
    for (std::size_t at = 0; (at = text.find("{{", at)) != std::string_view::npos; at += 2) {
        const auto words = words_of(text.substr(at + 2, text.find("}}", at) - at - 2));
        if (words.at(0) == "end" && --depth == 0) return at;
        depth += is_block(words[0]) ? 1 : 0;
    }
    throw std::logic_error("a page's block has no end");
}

}  // namespace

int decimals_of_error(double error) {
    constexpr int MOST = 9;
    if (!(error > 0)) return MOST;
    return std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, MOST);
}

PageTemplate::PageTemplate(const nlohmann::json& report) : report_(report) {
    add_field("number", [&](const Words& w) { return number(report, w.at(1)); });
    add_field("percent", [&](const Words& w) { return number(report, w.at(1), PERCENT, "%"); });
    add_field("signed_percent", [&](const Words& w) { return signed_percent(report, w.at(1)); });
    add_field("seconds", [&](const Words& w) { return seconds(report, w.at(1)); });
    add_field("whole", [&](const Words& w) { return whole(report, w.at(1)); });
    add_field("fixed", [&](const Words& w) {
        return fixed(report, w.at(1), std::stoi(w.at(2)), w.size() > 3 ? w[3] : std::string());
    });
    add_field("with_error", [&](const Words& w) { return with_error(report, w.at(1), w.at(2)); });
    add_field("text", [&](const Words& w) { return text(report, w.at(1)); });
    add_field("count",
              [&](const Words& w) { return std::to_string(report.at(nlohmann::json::json_pointer(w.at(1))).size()); });
    add_block("each", [this](const Words& w, const std::string& body) {
        std::string out;
        const std::size_t count = report_.at(nlohmann::json::json_pointer(w.at(1))).size();
        for (std::size_t i = 0; i < count; ++i) out += fill_at(body, fmt::format("{}/{}", w[1], i));
        return out;
    });
    add_block("if", [this](const Words& w, const std::string& body) {
        const auto& value = report_.at(nlohmann::json::json_pointer(w.at(1)));
        const bool holds = value.is_boolean() ? value.get<bool>() : !value.empty();
        return holds ? fill(body) : std::string();
    });
}

std::string PageTemplate::fill_at(std::string_view text, const std::string& pointer) const {
    std::string here;
    for (const char c : text) here += c == '$' ? pointer : std::string(1, c);
    return fill(here);
}

std::string PageTemplate::fill(std::string_view text) const {
    std::string out;
    while (true) {
        const std::size_t begin = text.find("{{");
        out += text.substr(0, begin);
        if (begin == std::string_view::npos) return out;
        const std::size_t end = text.find("}}", begin);
        const Words words = words_of(text.substr(begin + 2, end - begin - 2));
        text.remove_prefix(std::min(end, text.size() - 2) + 2);
        if (const auto block = blocks_.find(words.at(0)); block != blocks_.end()) {
            const auto close = end_of_block(text, [&](const std::string& name) { return blocks_.contains(name); });
            out += block->second(words, std::string(text.substr(0, close)));
            text.remove_prefix(text.find("}}", close) + 2);
        } else if (const auto field = fields_.find(words[0]); field != fields_.end()) {
            out += field->second(words);
        } else {
            throw std::logic_error("no field of a page is named " + words[0]);
        }
    }
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
    std::string commands;
    for (const auto& command : figure.commands) commands += fmt::format("<pre>{}</pre>", command_html(command));
    return fmt::format(
        "<figure id=\"about_{}\" class=\"{}\">\n<div class=\"picture\">{}</div>\n"
        "<figcaption>{}{}</figcaption>\n</figure>",
        figure.id, figure.shape, pictures, figure.caption, commands);
}

std::string page_html(const std::string& title, const std::string& body) {
    const nlohmann::json nothing;
    PageTemplate page(nothing);
    page.add_field("title", [&](const auto&) { return escaped(title); });
    page.add_field("style", [&](const auto&) { return page_text("page.css"); });
    page.add_field("body", [&](const auto&) { return body; });
    return page.fill(page_text("page.html"));
}

const std::string& page_text(std::string_view name) { return page_texts::all().at(std::string(name)); }

}  // namespace clerestory
