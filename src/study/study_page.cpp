#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "markup.hpp"
#include "page.hpp"
#include "study/report.hpp"

namespace clerestory {
namespace {

using nlohmann::json;
using Row = std::vector<std::string>;

/// Builds the page's sections; all numbers come from the report.
class Writer {
  public:
    Writer(const json& report, const std::map<std::string, std::string>& pictures)
        : report_(report), pictures_(pictures), p_(report) {}

    [[nodiscard]] std::string body() const {
        return header() + verdict_section() + convergence() + where() + harmonic() + tables() + all_points() + footer();
    }

  private:
    [[nodiscard]] std::string figure(const std::string& id, const std::string& title,
                                     const std::string& caption) const {
        const auto picture = pictures_.find(id);
        if (picture == pictures_.end()) return "";
        return figure_html({.id = "figure_" + id,
                            .title = title,
                            .caption = caption,
                            .pictures = {{.picture = picture->second}},
                            .commands = {report_.at("command").get<std::string>()},
                            .numbers = {},
                            .shape = "wide"});
    }

    [[nodiscard]] std::string card(const json& word) const {
        if (word.at("point").is_null()) return "";
        const auto at = fmt::format("/points/{}/", word.at("point").get<std::size_t>());
        const std::string question = word.at("question").get<std::string>();
        const std::string value = question.starts_with("under") ? error_of(at) : p_.seconds(at + "seconds");
        return fmt::format("<li><b>{}</b>{}: {}</li>", value, escaped(question), p_.text(at + "name"));
    }

    /// A point's error; the exact picture's is rounding, which is not measured here.
    [[nodiscard]] std::string error_of(const std::string& at) const {
        const bool exact = report_.at(json::json_pointer(at + "estimator")) == "exact";
        return exact ? "rounding" : p_.percent(at + "rel_rmse");
    }

    [[nodiscard]] std::string header() const {
        std::string cards;
        for (const auto& word : report_.at("words")) {
            const std::string question = word.at("question").get<std::string>();
            if (question == "under 5 ms" || question == "for 1 %" || question == "for 0.1 %") cards += card(word);
        }
        return fmt::format(
            "<header><h1>What each millisecond buys</h1>\n"
            "<p class=\"lead\">A white diffuse sphere under the map <i>{}</i> ({}&#8239;×&#8239;{}), lit in {} ways on "
            "this machine, each timed and held against the exact picture.</p>\n<ul class=\"key\">{}</ul>\n"
            "<nav aria-label=\"Sections\"><a href=\"#ranking\">Ranking</a><a href=\"#convergence\">Convergence</a>"
            "<a href=\"#where\">Where the error lies</a><a href=\"#harmonics\">Harmonics</a><a href=\"#tables\">Tables"
            "</a><a href=\"#points\">Every point</a><a href=\"#provenance\">Provenance</a></nav></header>\n",
            p_.text("/map/name"), p_.whole("/map/width"), p_.whole("/map/height"), report_.at("points").size(), cards);
    }

    [[nodiscard]] std::string verdict_section() const {
        std::vector<Row> rows;
        for (const auto& word : report_.at("words")) {
            const std::string question = escaped(word.at("question").get<std::string>());
            if (word.at("point").is_null()) {
                rows.push_back({question, "nothing that was measured", "", "", ""});
                continue;
            }
            const auto at = fmt::format("/points/{}/", word.at("point").get<std::size_t>());
            rows.push_back({question, p_.text(at + "name"), p_.seconds(at + "seconds"), error_of(at),
                            fmt::format("<code>{}</code>", p_.text(at + "flags"))});
        }
        return "<section id=\"ranking\"><h2>Error against time</h2>\n"
               "<p>Each point is one way to light the sphere. Time is one whole picture’s: projecting the map where "
               "harmonics are used, drawing samples, shading every pixel; kernels are compiled and the map’s tables "
               "built. Error is the relative RMSE over the sphere’s pixels and channels, in parts of the exact "
               "picture’s mean, as root mean square over seeds. The line joins the points that no other beats in "
               "both.</p>\n" +
               figure("error_time", "Error against time",
                      "To the left is faster, below is nearer to the exact picture. The dashed line is the time of the "
                      "exact "
                      "picture itself: whatever lies to the right of it isn’t worth its time.") +
               table_html(
                   "The best way under a time, and the fastest way to an error; of ways within 15 % of the fastest, "
                   "the most accurate.",
                   {"asked", "choose", "time", "relative RMSE", "flags of <code>render</code>"}, rows) +
               front_table() + "</section>\n";
    }

    [[nodiscard]] std::string front_table() const {
        std::vector<std::size_t> front = report_.at("pareto").get<std::vector<std::size_t>>();
        const auto& points = report_.at("points");
        std::sort(front.begin(), front.end(), [&](std::size_t a, std::size_t b) {
            return points[a].at("seconds").get<double>() < points[b].at("seconds").get<double>();
        });
        std::vector<Row> rows;
        for (const std::size_t i : front) {
            const auto at = fmt::format("/points/{}/", i);
            rows.push_back({p_.text(at + "name"), p_.seconds(at + "seconds"), p_.seconds(at + "stages/project"),
                            p_.seconds(at + "stages/draw"), p_.seconds(at + "stages/shade"), error_of(at),
                            p_.percent(at + "percentile99"), p_.percent(at + "worst")});
        }
        return table_html(
            "The front: nothing else that was measured is both faster and nearer. Medians over pictures.",
            {"way", "time", "project", "draw", "shade", "relative RMSE", "99 % of values within", "worst value"}, rows);
    }

    [[nodiscard]] std::string slope_table() const {
        std::vector<Row> rows;
        for (std::size_t i = 0; i < report_.at("slopes").size(); ++i) {
            const auto at = fmt::format("/slopes/{}/", i);
            const auto degree = report_.at("slopes")[i].at("control_degree").get<int>();
            rows.push_back({p_.text(at + "estimator") + " " + p_.text(at + "sequence"),
                            degree == 0 ? "none" : p_.whole(at + "control_degree"), p_.fixed(at + "slope", 3),
                            "± " + p_.fixed(at + "half_width", 3), p_.percent(at + "factor"), p_.whole(at + "points")});
        }
        return table_html(
            "Slope of error against samples on logarithmic axes, with its 95 % confidence interval. Independent "
            "samples give −0.5; the first error is the fit’s at one sample.",
            {"samples", "control degree", "slope", "interval", "first error", "points"}, rows);
    }

    [[nodiscard]] std::string convergence() const {
        return "<section id=\"convergence\"><h2>Error against samples</h2>\n"
               "<p>Stratified and Sobol’ points cover the map more evenly than random ones, so their error falls "
               "faster. "
               "A control variate takes out what spherical harmonics know exactly; samples answer only for the rest, "
               "which lowers the whole line.</p>\n" +
               figure("error_samples_shared", "One sample set for every pixel",
                      "Plain, and with a control variate of degree 8.") +
               figure(
                   "error_samples_per_pixel", "A fresh sample set for each pixel",
                   "The same with sets that no two pixels share. An equal number of samples gives an equal error, for "
                   "much more drawing.") +
               slope_table() + "</section>\n";
    }

    [[nodiscard]] std::string where() const {
        return "<section id=\"where\"><h2>Where the error lies</h2>\n"
               "<p>One picture by each of six ways. Colours are in parts of each picture’s own RMSE, so that all six "
               "show their pattern; the number below each says how large it is.</p>\n" +
               figure(ERROR_MAPS, "Blue is too dark, orange too bright",
                      "A shared set errs in broad stains that no blur takes away, fresh sets in grain, harmonics in "
                      "faint ripples.") +
               "</section>\n";
    }

    [[nodiscard]] std::string harmonic() const {
        return "<section id=\"harmonics\"><h2>No samples at all</h2>\n"
               "<p>A diffuse surface blurs the map so much that a short series of spherical harmonics holds nearly all "
               "of its light. What the series misses are small bright lights: the brightest texels are taken out of it "
               "and "
               "shine on their own.</p>\n" +
               figure("harmonic", "Degree and lights",
                      "Error against the series’ degree, for several numbers of lights.") +
               "</section>\n";
    }

    [[nodiscard]] std::string tables() const {
        std::vector<Row> rows;
        for (std::size_t i = 0; i < report_.at("tables").size(); ++i) {
            const auto at = fmt::format("/tables/{}/", i);
            rows.push_back({p_.text(at + "arithmetic"), p_.seconds(at + "seconds"), p_.whole(at + "undrawable"),
                            p_.number(at + "total_variation"), p_.number(at + "largest_relative_error"),
                            p_.number(at + "total_relative_error")});
        }
        return "<section id=\"tables\"><h2>What the tables are worth</h2>\n"
               "<p>Samples are drawn from cumulative sums over the map. Summed in float32, some lit texels get no "
               "share "
               "and can never be drawn; whole numbers lose none.</p>\n" +
               figure("table_error_time", "Table error against time to build",
                      "The error is the total variation: the share of all samples that fall into a wrong texel.") +
               table_html(fmt::format("The {} lit texels of this map.",
                                      report_.at("tables").empty() ? "" : p_.whole("/tables/0/lit")),
                          {"arithmetic", "time", "lit texels never drawn", "total variation",
                           "largest relative error of a texel", "relative error of the sum"},
                          rows) +
               "</section>\n";
    }

    [[nodiscard]] std::string all_points() const {
        std::vector<Row> rows;
        for (std::size_t i = 0; i < report_.at("points").size(); ++i) {
            const auto at = fmt::format("/points/{}/", i);
            rows.push_back({p_.text(at + "name"), p_.whole(at + "seeds"), error_of(at),
                            p_.percent(at + "rel_rmse_deviation"), p_.percent(at + "bias"),
                            p_.percent(at + "bias_noise"), p_.percent(at + "percentile99"), p_.percent(at + "worst"),
                            p_.seconds(at + "seconds"), p_.seconds(at + "seconds_low"),
                            p_.seconds(at + "seconds_high")});
        }
        std::string skipped;
        if (!report_.at("left_out").empty()) {
            skipped = fmt::format("<p>Left out, because the budget of {} was spent: ", p_.seconds("/budget_seconds"));
            for (std::size_t i = 0; i < report_.at("left_out").size(); ++i) {
                skipped += (i > 0 ? "; " : "") + p_.text(fmt::format("/left_out/{}/name", i));
            }
            skipped += ".</p>\n";
        }
        return fmt::format(
                   "<section id=\"points\"><h2>Every point</h2>\n"
                   "<p>The root mean square of the mean over seeds is bias and what noise the mean still has; beside "
                   "it "
                   "stands what noise alone would leave. Harmonics have no noise: all their error is bias. {} points "
                   "took fewer than the {} seeds asked for, to stay within the budget.</p>\n",
                   p_.whole("/short_of_seeds"), p_.whole("/seeds")) +
               skipped + "<details><summary>All points</summary>\n" +
               table_html("The same numbers are in study.csv.",
                          {"way", "seeds", "relative RMSE", "± over seeds", "mean over seeds off by", "by noise alone",
                           "99 % of values within", "worst value", "time", "a quarter below", "a quarter above"},
                          rows) +
               "</details></section>\n";
    }

    [[nodiscard]] std::string footer() const {
        return fmt::format(
            "<footer id=\"provenance\"><p>Made by clerestory {} on {} in {}. Map <i>{}</i>, {}&#8239;×&#8239;{}, "
            "rotated by {}°{}. Spheres of {}&#8239;×&#8239;{} pixels; first seed {}. The map’s tables took {} and are "
            "in no "
            "time above. Device: {} ({}), {} compute units. Every number here is also in "
            "<code>study.json</code>.</p></footer>\n",
            p_.text("/version"), p_.text("/created"), p_.seconds("/seconds"), p_.text("/map/name"),
            p_.whole("/map/width"), p_.whole("/map/height"), p_.whole("/map/rotate_y"),
            report_.at("map").at("flip_y").get<bool>() ? ", rows read bottom-up" : "", p_.whole("/size"),
            p_.whole("/size"), p_.whole("/seed"), p_.seconds("/table_seconds"), p_.text("/device"),
            p_.text("/platform"), p_.whole("/compute_units"));
    }

    const json& report_;
    const std::map<std::string, std::string>& pictures_;
    PageNumbers p_;
};

}  // namespace

std::string study_page(const json& report, const std::map<std::string, std::string>& pictures) {
    return page_html("Clerestory: what each millisecond buys", Writer(report, pictures).body());
}

}  // namespace clerestory
