#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/text_escape.hpp"
#include "draw/html_page.hpp"
#include "study/report.hpp"

namespace clerestory {
namespace {

using nlohmann::json;
using Words = PageTemplate::Words;

const json& at(const json& report, const std::string& pointer) { return report.at(json::json_pointer(pointer)); }

std::string place_of(const json& word) { return fmt::format("/points/{}", word.at("point").get<std::size_t>()); }

/// The best answers to three of the questions, large.
std::string cards(const json& report, const PageTemplate& page) {
    std::string out;
    for (const auto& word : report.at("words")) {
        const std::string question = word.at("question").get<std::string>();
        if (question != "under 5 ms" && question != "for 1 %" && question != "for 0.1 %") continue;
        if (word.at("point").is_null()) continue;
        const std::string value = question.starts_with("under") ? "{{error $}}" : "{{seconds $/seconds}}";
        out += page.fill_at("<li><b>" + value + "</b>" + escaped(question) + ": {{text $/name}}</li>", place_of(word));
    }
    return out;
}

std::string verdicts(const json& report, const PageTemplate& page) {
    std::string rows;
    for (const auto& word : report.at("words")) {
        const std::string asked = "<tr><td>" + escaped(word.at("question").get<std::string>()) + "</td>";
        if (word.at("point").is_null()) {
            rows += asked + "<td>nothing that was measured</td><td></td><td></td><td></td></tr>\n";
            continue;
        }
        rows += asked + page.fill_at(
                            "<td>{{text $/name}}</td><td>{{seconds $/seconds}}</td><td>{{error $}}</td>"
                            "<td><code>{{text $/flags}}</code></td></tr>\n",
                            place_of(word));
    }
    return rows;
}

/// Once for every point of the front, from fast to slow.
std::string each_of_front(const json& report, const PageTemplate& page, const std::string& body) {
    auto front = report.at("pareto").get<std::vector<std::size_t>>();
    const auto& points = report.at("points");
    std::sort(front.begin(), front.end(), [&](std::size_t a, std::size_t b) {
        return points[a].at("seconds").get<double>() < points[b].at("seconds").get<double>();
    });
    std::string rows;
    for (const std::size_t i : front) rows += page.fill_at(body, fmt::format("/points/{}", i));
    return rows;
}

std::string left_out(const json& report) {
    std::vector<std::string> names;
    for (const auto& method : report.at("left_out")) names.push_back(escaped(method.at("name").get<std::string>()));
    return fmt::format("{}", fmt::join(names, "; "));
}

}  // namespace

std::string study_page(const json& report, const std::map<std::string, std::string>& pictures) {
    PageTemplate page(report);
    page.add_field("cards", [&](const Words&) { return cards(report, page); });
    page.add_field("verdicts", [&](const Words&) { return verdicts(report, page); });
    page.add_field("left_out", [&](const Words&) { return left_out(report); });
    page.add_field("degree", [&](const Words& w) {
        return at(report, w.at(1)) == 0 ? "none" : page.fill_at("{{whole $}}", w[1]);
    });
    // The exact picture's error is rounding, which is not measured here.
    page.add_field("error", [&](const Words& w) {
        return at(report, w.at(1) + "/estimator") == "exact" ? "rounding"
                                                             : page.fill_at("{{percent $/rel_rmse}}", w[1]);
    });
    page.add_block("each_of_front",
                   [&](const Words&, const std::string& body) { return each_of_front(report, page, body); });
    page.add_block("figure", [&](const Words& w, const std::string& body) -> std::string {
        const auto picture = pictures.find(w.at(1));
        if (picture == pictures.end()) return "";
        return figure_html({.id = "figure_" + w[1],
                            .shape = w.at(2),
                            .caption = page.fill(body),
                            .pictures = {{.picture = picture->second}},
                            .commands = {report.at("command").get<std::string>()}});
    });
    return page_html("Clerestory: what each millisecond buys", page.fill(page_text("study_page.html")));
}

}  // namespace clerestory
