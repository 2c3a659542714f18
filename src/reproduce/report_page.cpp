#include "reproduce/report_page.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "markup.hpp"
#include "page.hpp"

namespace clerestory {
namespace {

using Numbers = std::vector<std::pair<std::string, std::string>>;

/// Builds the page's sections; all numbers come from the report.
class Writer {
  public:
    Writer(const nlohmann::json& report, const std::map<std::string, std::string>& pictures)
        : report_(report), pictures_(pictures), p_(report) {}

    [[nodiscard]] std::string body() const {
        return header() + reflectance() + sample_maps() + shared_spheres() + fresh_spheres() + truth() +
               bias_and_noise() + convergence() + footer();
    }

  private:
    [[nodiscard]] static std::string key(const std::string& id, const std::string& name) {
        return fmt::format("/figures/{}/{}", id, name);
    }

    [[nodiscard]] std::string command_of(const std::string& id) const {
        return report_.at("figures").at(id).at("command").get<std::string>();
    }

    [[nodiscard]] std::string figure(const std::string& id, const std::string& title, const std::string& caption,
                                     const std::string& alt, Numbers numbers, const std::string& shape = "") const {
        return figure_html({.id = id,
                            .title = title,
                            .caption = caption,
                            .pictures = {{.picture = pictures_.at(id), .alt = alt}},
                            .commands = {command_of(id)},
                            .numbers = std::move(numbers),
                            .shape = shape});
    }

    [[nodiscard]] std::string header() const {
        const auto card = [](const std::string& value, const std::string& what) {
            return fmt::format("<li><b>{}</b>{}</li>", value, what);
        };
        return fmt::format(
            "<header><h1>One sphere, one photographed sky</h1>\n"
            "<p class=\"lead\">Every figure of the course report on importance sampling, made anew from the map "
            "<i>{}</i> ({}&#8239;×&#8239;{}), and its claims about error measured against the exact answer.</p>\n"
            "<ul class=\"key\">{}{}{}{}</ul>\n"
            "<nav aria-label=\"Sections\"><a href=\"#reflectance\">Reflectance</a><a href=\"#samples\">Where samples "
            "go</a><a href=\"#shared\">One shared set</a><a href=\"#fresh\">Fresh sets</a><a href=\"#truth\">Error</a>"
            "<a href=\"#bias\">Bias and noise</a><a href=\"#convergence\">Convergence</a>"
            "<a href=\"#provenance\">Provenance</a></nav></header>\n",
            p_.text("/map/name"), p_.whole("/map/width"), p_.whole("/map/height"),
            card(p_.percent(key("figure_06b", "rel_rmse")), "error of 1024 samples shared by all pixels"),
            card(p_.percent(key("figure_10", "rel_rmse")), "error of 32 fresh samples for every pixel"),
            card(p_.fixed("/figures/figure_15/fits/shared/slope", 2) + " and " +
                     p_.fixed("/figures/figure_15/fits/per-pixel/slope", 2),

                 "slopes of error against samples, shared and fresh; theory says −0.5"),
            card(p_.seconds("/exact/seconds"), "for the exact sphere that all errors are held against"));
    }

    [[nodiscard]] Numbers fresnel_numbers(const std::string& id) const {
        Numbers numbers = {{"R<sub>0</sub>", p_.number(key(id, "r0"))},
                           {"Brewster’s angle", p_.fixed(key(id, "brewster_deg"), 4, "°")}};
        if (report_.at("figures").at(id).at("critical_deg").is_number()) {
            numbers.emplace_back("critical angle", p_.fixed(key(id, "critical_deg"), 4, "°"));
        }
        numbers.emplace_back("Schlick’s worst relative error",
                             p_.percent(key(id, "schlick_max_rel_error")) + " at " +
                                 p_.fixed(key(id, "schlick_max_rel_error_deg"), 1, "°"));
        return numbers;
    }

    [[nodiscard]] std::string reflectance() const {
        return "<section id=\"reflectance\"><h2>How much a glass surface reflects</h2>\n"
               "<p>Fresnel’s equations give the share of light that a smooth dielectric reflects, for each "
               "polarisation. "
               "Schlick’s polynomial approximates their mean from the reflectance at normal incidence alone. The "
               "angles of "
               "interest are computed, not read off the curves.</p>\n" +
               figure(
                   "figure_01a", "Figure 1a: from air into glass, n 1 → 1.5",
                   "The parallel component vanishes at Brewster’s angle, so light reflected there is fully polarised. "
                   "The report read 56.4° off its plot; the exact angle is arctan(1.5), marked here.",
                   "", fresnel_numbers("figure_01a")) +
               figure("figure_01b", "Figure 1b: from glass into air, n 1.5 → 1",
                      "Past the critical angle all light is reflected. The report read 42.4° off its plot; the exact "
                      "angle "
                      "is arcsin(1/1.5). Schlick takes the cosine of the transmitted, larger angle here.",
                      "", fresnel_numbers("figure_01b")) +
               "</section>\n";
    }

    [[nodiscard]] std::string sample_figure(const std::string& id, const std::string& number,
                                            const std::string& caption) const {
        const auto samples = p_.whole(key(id, "samples"));
        return figure(id, fmt::format("Figure {}: {} samples", number, samples), caption,
                      fmt::format("The map with {} green squares where samples were drawn",
                                  report_.at("figures").at(id).at("samples").get<int>()),
                      {{"different texels hit", p_.whole(key(id, "distinct_texels"))},
                       {"of the map’s texels", p_.percent(key(id, "distinct_share"))},
                       {"time to draw", p_.seconds(key(id, "seconds"))}});
    }

    [[nodiscard]] std::string sample_maps() const {
        return fmt::format(
                   "<section id=\"samples\"><h2>Where the samples go</h2>\n"
                   "<p>A texel is drawn with a probability in proportion to its intensity times its solid angle, so "
                   "samples "
                   "crowd where the light comes from. Each is marked by a 5&#8239;×&#8239;5 green square. Previews are "
                   "shown with exposure {} and gamma {}.</p>\n",
                   p_.whole("/exposure"), p_.whole("/gamma")) +
               sample_figure("figure_02", "2",
                             "Most squares lie on the brightest light; the rest of the map is barely seen.") +
               sample_figure("figure_03", "3", "Four times the samples fill in the second brightest places.") +
               sample_figure("figure_04", "4",
                             "The dim parts are now reached too, rarely: what a dim texel adds is divided by its small "
                             "probability, so nothing is left out on average.") +
               figure("figure_07", "Figure 7: the map as the sphere sees it",
                      fmt::format("The map turned by {}° about the vertical axis: its columns roll to the right by {}. "
                                  "All spheres below are lit by this.",
                                  p_.whole("/map/rotate_y"), p_.number("/figures/figure_07/columns")),
                      "The map with its columns rolled", {}) +
               "</section>\n";
    }

    [[nodiscard]] std::string sphere(const std::string& id, const std::string& number, const std::string& title,
                                     const std::string& caption) const {
        const auto control = [&](const char* name) { return key(id, std::string("control/") + name); };
        return figure_html(
            {.id = id,
             .title = fmt::format("Figure {}: {}", number, title),
             .caption = caption,
             .pictures = {{.picture = pictures_.at(id), .alt = "The lit sphere", .note = "as in the report"},
                          {.picture = pictures_.at(id + "_control"),
                           .alt = "The same sphere with a control variate",
                           .note = fmt::format("same samples, control variate of degree {}",
                                               p_.whole(control("control_degree")))}},
             .commands = {command_of(id), report_.at("figures").at(id).at("control").at("command").get<std::string>()},
             .numbers = {{"relative RMSE", p_.percent(key(id, "rel_rmse"))},
                         {"typical over seeds", typical(id)},
                         {"brightness off by", p_.signed_percent(key(id, "bias"))},
                         {"neighbours’ errors correlate", p_.fixed(key(id, "neighbour_correlation"), 3)},
                         {"time", p_.seconds(key(id, "seconds"))},
                         {"with control: relative RMSE", p_.percent(control("rel_rmse"))},
                         {"with control: time", p_.seconds(control("seconds"))}},
             .shape = "pair"});
    }

    /// The error over seeds of pictures made like this one.
    [[nodiscard]] std::string typical(const std::string& id) const {
        const auto& figure = report_.at("figures").at(id);
        const auto& studies = report_.at("studies");
        for (std::size_t i = 0; i < studies.size(); ++i) {
            const bool same = studies[i].at("estimator") == figure.at("estimator") &&
                              studies[i].at("samples") == figure.at("samples") && studies[i].at("control_degree") == 0;
            if (!same) continue;
            const std::string at = fmt::format("/studies/{}/", i);
            return p_.percent(at + "rel_rmse") + " ± " + p_.percent(at + "rel_rmse_deviation");
        }
        return {};
    }

    [[nodiscard]] std::string shared_spheres() const {
        return "<section id=\"shared\"><h2>One set of samples for all pixels</h2>\n"
               "<p>A white diffuse sphere, seen along −z without perspective. Every pixel sums the same lights, so the "
               "picture is smooth at any number of samples. Smooth isn’t right: the whole picture is lit by a few "
               "lamps in "
               "place of the map, and errs together.</p>\n" +
               sphere("figure_05", "5", "one shared set of 64 samples",
                      "Hold its shading against figure 11: the light comes from a slightly wrong side, a little too "
                      "strong or too weak, and nothing in the picture tells.") +
               sphere("figure_06a", "6a", "one shared set of 256 samples",
                      "Four times the samples: half the error on average, but a single set may be lucky or not.") +
               sphere("figure_06b", "6b", "one shared set of 1024 samples",
                      "To the eye it is done; its error shows in figure 12.") +
               "</section>\n";
    }

    [[nodiscard]] std::string fresh_spheres() const {
        return "<section id=\"fresh\"><h2>A fresh set for every pixel</h2>\n"
               "<p>What PBRT does: each pixel draws its own samples. Neighbours err independently, which is seen as "
               "grain. "
               "The eye averages over grain, and the mean brightness is close to right from the first picture "
               "on.</p>\n" +
               sphere("figure_08", "8", "8 fresh samples for every pixel", "Grain all over, but no wrong edges.") +
               sphere("figure_09", "9", "16 fresh samples for every pixel",
                      "Twice the samples make the grain smaller by a factor of 1.4.") +
               sphere("figure_10", "10", "32 fresh samples for every pixel", "Compare its brightness with figure 11.") +
               "</section>\n";
    }

    [[nodiscard]] std::string truth() const {
        return "<section id=\"truth\"><h2>How far off they are</h2>\n"
               "<p>The light on a diffuse surface can be computed without sampling: each texel’s part above the "
               "horizon has "
               "a closed form. That exact picture is what all errors on this page are held against. Relative RMSE is "
               "over "
               "the sphere’s pixels and three channels, in parts of the exact picture’s mean.</p>\n" +
               figure("figure_11", "Figure 11: the exact sphere", "No samples, no seed: error by rounding only.",
                      "The sphere, lit exactly",
                      {{"pixels", p_.whole("/figures/figure_11/pixels")},
                       {"mean radiance", p_.number("/figures/figure_11/mean_radiance")},
                       {"time", p_.seconds("/figures/figure_11/seconds")}},
                      "sphere") +
               figure(
                   "figure_12", "Figure 12: where each picture is too bright or too dark",
                   "One colour scale for all; a colour’s strength goes with the root of the error, so that small "
                   "errors "
                   "show. Above, shared sets: broad stains, whole sides of the sphere too bright or too dark. Below, "
                   "fresh sets: grain without a pattern.",
                   "", {}, "wide") +
               "</section>\n";
    }

    [[nodiscard]] std::string studies_table() const {
        std::vector<std::vector<std::string>> rows;
        const auto& studies = report_.at("studies");
        for (std::size_t i = 0; i < studies.size(); ++i) {
            const auto at = [i](const char* name) { return fmt::format("/studies/{}/{}", i, name); };
            const auto& sides = studies[i].at("block_sides");
            const char* sets = studies[i].at("estimator") == "shared" ? "shared" : "fresh";
            rows.push_back({studies[i].at("control_degree") == 0 ? sets : fmt::format("{}, control", sets),
                            p_.whole(at("samples")), p_.percent(at("rel_rmse")), p_.percent(at("rel_rmse_deviation")),
                            p_.signed_percent(at("bias")), p_.percent(at("bias_standard_error")),
                            p_.percent(at("mean_over_seeds_rms")), p_.percent(at("mean_over_seeds_expected_rms")),
                            p_.percent(fmt::format("/studies/{}/block_rms/{}", i, sides.size() - 1)),
                            p_.seconds(at("seconds"))});
        }
        const auto largest = studies[0].at("block_sides").back().get<int>();
        return table_html(fmt::format("Each line over {} seeds of its own.", p_.whole("/seeds")),
                          {"sets", "samples", "relative RMSE", "± over seeds", "mean brightness off by",
                           "± standard error", "RMS of the mean over seeds", "by noise alone",
                           fmt::format("left after averaging {0}×{0} pixels", largest), "time a picture"},
                          rows);
    }

    [[nodiscard]] std::string bias_and_noise() const {
        const std::string curves = "/figures/figure_14/curves/";
        return fmt::format(
                   "<section id=\"bias\"><h2>Biased, or noisy?</h2>\n"
                   "<p>The report says that shared sets are smooth but biased together, and per-pixel sets noisy but "
                   "unbiased. Within one picture that is what one sees. Over many pictures both are right on average: "
                   "the "
                   "error of a shared set is noise too, only that all pixels draw the same noise. To tell them apart, "
                   "each picture was made {} times, with other seeds.</p>\n",
                   p_.whole("/seeds")) +
               figure("figure_13", "Figure 13: one picture, the mean, and the spread",
                      fmt::format(
                          "Left, the error of one picture. Middle, the mean error over seeds: an unbiased estimator "
                          "leaves "
                          "only its noise divided by the root of the number of seeds. Shared: {} is left where noise "
                          "alone "
                          "would leave {}. Fresh: {} where noise alone would leave {}. Right, the spread over seeds.",
                          p_.percent("/figures/figure_13/rows/0/mean_over_seeds_rms"),
                          p_.percent("/figures/figure_13/rows/0/mean_over_seeds_expected_rms"),
                          p_.percent("/figures/figure_13/rows/1/mean_over_seeds_rms"),
                          p_.percent("/figures/figure_13/rows/1/mean_over_seeds_expected_rms")),
                      "", {}, "wide") +
               figure(
                   "figure_14", "Figure 14: can it be blurred away?",
                   "Averaging neighbouring pixels mends errors that they make independently, and none that they share. "
                   "Fresh sets’ error falls with the side of the square; a shared set’s stays.",
                   "",
                   {{"64 shared: left after the largest square", p_.percent(curves + "0/kept")},
                    {"32 fresh: left after the largest square", p_.percent(curves + "3/kept")},
                    {"64 shared: slope", p_.number(curves + "0/slope")},
                    {"32 fresh: slope (independent pixels: −1)", p_.number(curves + "3/slope")}}) +
               "</section>\n";
    }

    [[nodiscard]] std::string convergence() const {
        const std::string fits = "/figures/figure_15/fits/";
        const auto slope = [&](const std::string& name) {
            return p_.with_error(fits + name + "/slope", fits + name + "/half_width_95");
        };
        return "<section id=\"convergence\"><h2>Both converge</h2>\n" +
               figure("figure_15", "Figure 15: error against the number of samples",
                      "Points are root mean squares over seeds, bars one standard deviation. Lines are least-squares "
                      "fits to every "
                      "seed’s "
                      "picture; slopes are given with their 95 % confidence intervals. Random sampling converges with "
                      "slope "
                      "−1/2: four times the samples for half the error, whichever way they are spent. The control "
                      "variate takes away what eight degrees of spherical harmonics know exactly, and samples only the "
                      "rest: the slope stays, the line sinks.",
                      "",
                      {{"slope, shared", slope("shared")},
                       {"slope, fresh", slope("per-pixel")},
                       {"error of one sample, shared", p_.percent(fits + "shared/one_sample_rel_rmse")},
                       {"error of one sample, fresh", p_.percent(fits + "per-pixel/one_sample_rel_rmse")},
                       {"with control, shared", p_.percent(fits + "shared-control/one_sample_rel_rmse")},
                       {"with control, fresh", p_.percent(fits + "per-pixel-control/one_sample_rel_rmse")}}) +
               "<p>A sample is worth the same in a shared set as in a pixel’s own: the errors of a single sample, "
               "above, agree within what seeds scatter. What differs is the price. A shared set is drawn once for all "
               "pixels, so at equal time it affords many more "
               "samples.</p>\n" +
               studies_table() + "</section>\n";
    }

    [[nodiscard]] std::string footer() const {
        return fmt::format(
            "<footer id=\"provenance\"><p>Made by {} {} on {} in {}. Map <i>{}</i>, {}&#8239;×&#8239;{}, rotated by "
            "{}°, "
            "radiance times {}{}. Seed {}; studies over {} further seeds each. Spheres {}&#8239;×&#8239;{} pixels, "
            "albedo 1. "
            "Exposure {}{}, gamma {}. Device: {} ({}). Every number here is also in "
            "<code>report.json</code>.</p></footer>\n",
            p_.text("/program"), p_.text("/version"), p_.text("/created"), p_.seconds("/seconds"), p_.text("/map/name"),
            p_.whole("/map/width"), p_.whole("/map/height"), p_.whole("/map/rotate_y"), p_.whole("/map/scale"),
            report_.at("map").at("flip_y").get<bool>() ? ", rows read bottom-up" : "", p_.whole("/seed"),
            p_.whole("/seeds"), p_.whole("/size"), p_.whole("/size"), p_.whole("/exposure"),
            report_.at("exposure_chosen").get<bool>() ? " (the exact sphere’s bright end is nearly white)" : "",
            p_.whole("/gamma"), p_.text("/device"), p_.text("/platform"));
    }

    const nlohmann::json& report_;
    const std::map<std::string, std::string>& pictures_;
    PageNumbers p_;
};

}  // namespace

std::string report_page(const nlohmann::json& report, const std::map<std::string, std::string>& pictures) {
    return page_html("Clerestory: every figure of the course report", Writer(report, pictures).body());
}

}  // namespace clerestory
