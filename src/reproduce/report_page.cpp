#include "reproduce/report_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "draw/html_page.hpp"

namespace clerestory {
namespace {

using nlohmann::json;
using Words = PageTemplate::Words;

/// The error over seeds of pictures made like the figure at `pointer`.
std::string typical(const json& report, const PageTemplate& page, const std::string& pointer) {
    const auto& figure = report.at(json::json_pointer(pointer));
    const auto& studies = report.at("studies");
    const auto same = std::find_if(studies.begin(), studies.end(), [&](const json& study) {
        return study.at("estimator") == figure.at("estimator") && study.at("samples") == figure.at("samples") &&
               study.at("control_degree") == 0;
    });
    if (same == studies.end()) return {};
    return page.fill_at("{{percent $/rel_rmse}} ± {{percent $/rel_rmse_deviation}}",
                        fmt::format("/studies/{}", same - studies.begin()));
}

/// What a set of samples is called in the table of studies.
std::string sets(const json& study) {
    const std::string name = study.at("estimator") == "shared" ? "shared" : "fresh";
    return study.at("control_degree") == 0 ? name : name + ", control";
}

/// A sphere as in the report beside the same samples with a control variate.
std::string sphere(const json& report, const std::map<std::string, std::string>& pictures, const PageTemplate& page,
                   const std::string& id, const std::string& body) {
    const std::string pointer = "/figures/" + id;
    const json& figure = report.at("figures").at(id);
    return figure_html(
        {.id = id,
         .shape = "pair",
         .caption = page.fill(body) + page.fill_at(page_text("report_sphere.html"), pointer),
         .pictures = {{.picture = pictures.at(id), .alt = "The lit sphere", .note = "as in the report"},
                      {.picture = pictures.at(id + "_control"),
                       .alt = "The same sphere with a control variate",
                       .note = page.fill_at(
                           "same samples, control variate of degree {{whole $/control/control_degree}}", pointer)}},
         .commands = {figure.at("command").get<std::string>(), figure.at("control").at("command").get<std::string>()}});
}

}  // namespace

std::string report_page(const json& report, const std::map<std::string, std::string>& pictures) {
    PageTemplate page(report);
    page.add_field("typical", [&](const Words& w) { return typical(report, page, w.at(1)); });
    page.add_field("sets", [&](const Words& w) { return sets(report.at(json::json_pointer(w.at(1)))); });
    page.add_field("largest_block", [&](const Words&) {
        return fmt::format("{0}×{0}", report.at("studies").at(0).at("block_sides").back().get<int>());
    });
    page.add_field("last_percent", [&](const Words& w) {
        const std::size_t count = report.at(json::json_pointer(w.at(1))).size();
        return page.fill_at("{{percent $}}", fmt::format("{}/{}", w[1], count - 1));
    });
    page.add_block("figure", [&](const Words& w, const std::string& body) {
        const std::vector<std::string> alt(w.begin() + 3, w.end());
        return figure_html({.id = w.at(1),
                            .shape = w.at(2),
                            .caption = page.fill(body),
                            .pictures = {{.picture = pictures.at(w[1]), .alt = fmt::format("{}", fmt::join(alt, " "))}},
                            .commands = {report.at("figures").at(w[1]).at("command").get<std::string>()}});
    });
    page.add_block("sphere", [&](const Words& w, const std::string& body) {
        return sphere(report, pictures, page, w.at(1), body);
    });
    return page_html("Clerestory: every figure of the course report", page.fill(page_text("report_page.html")));
}

}  // namespace clerestory
