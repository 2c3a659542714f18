#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "base/clock.hpp"
#include "base/statistics.hpp"
#include "draw/html_page.hpp"
#include "draw/panels.hpp"
#include "draw/plot.hpp"
#include "error.hpp"
#include "reproduce/figures.hpp"

namespace clerestory {
namespace {

constexpr std::array<std::size_t, 5> SHARED_COUNTS = {16, 64, 256, 1024, 4096};
constexpr std::array<std::size_t, 5> PER_PIXEL_COUNTS = {2, 4, 8, 16, 32};
constexpr std::array<std::size_t, 3> PER_PIXEL_CONTROL_COUNTS = {2, 4, 8};

/// An estimator as the convergence plot has it: its subject but for the samples, its name in the report, its label.
struct Family {
    StudySubject subject;
    const char* name;
    const char* label;
    plot::Colour colour;
};
constexpr std::array FAMILIES = {
    Family{{Estimator::shared, 0, 0}, "shared", "one shared set", plot::Colour::blue},
    Family{{Estimator::per_pixel, 0, 0}, "per-pixel", "fresh sets", plot::Colour::vermillion},
    Family{{Estimator::shared, CONTROL_DEGREE, 0}, "shared-control", "shared, control", plot::Colour::green},
    Family{{Estimator::per_pixel, CONTROL_DEGREE, 0}, "per-pixel-control", "fresh, control", plot::Colour::purple}};

// What is shown of the seeds' studies: errors of like size.
constexpr StudySubject SHOWN_SHARED = {Estimator::shared, 0, 64};
constexpr StudySubject SHOWN_PER_PIXEL = {Estimator::per_pixel, 0, 32};

constexpr double PERCENT = 100;

std::string percent(double part) { return fmt::format("{:.3g} %", PERCENT * part); }

std::vector<double> in_percent(std::vector<double> parts) {
    for (double& part : parts) part *= PERCENT;
    return parts;
}

nlohmann::json numbers_of(const SeedErrors& study, const std::vector<std::size_t>& sides) {
    const Spread rmse = spread_of(study.rel_rmse);
    const Spread bias = spread_of(study.rel_bias);
    const auto seeds = study.rel_rmse.size();
    return {{"estimator", estimator_name(study.method.estimator)},
            {"control_degree", study.method.sampling.control_degree},
            {"samples", study.method.samples},
            {"first_seed", study.method.sampling.seed},
            {"seeds", seeds},
            {"seconds", study.seconds},
            {"rel_rmse", root_mean_square(study.rel_rmse)},
            {"rel_rmse_deviation", rmse.deviation},
            {"rel_rmse_each", study.rel_rmse},
            {"bias", bias.mean},
            {"bias_deviation", bias.deviation},
            {"bias_standard_error", bias.standard_error},
            {"bias_each", study.rel_bias},
            {"mean_over_seeds_rms", study.mean_rms},
            {"spread_over_seeds_rms", study.spread_rms},
            {"mean_over_seeds_expected_rms", study.spread_rms / std::sqrt(static_cast<double>(seeds))},
            {"block_sides", sides},
            {"block_rms", study.block_rms}};
}

/// Points of one estimator's studies, every seed its own.
struct Points {
    std::vector<double> samples, rel_rmse;
};

Points points_of(const std::vector<SeedErrors>& studies, const StudySubject& of) {
    Points points;
    for (const auto& study : studies) {
        if (study.method.estimator != of.estimator || study.method.sampling.control_degree != of.control_degree)
            continue;
        for (const double rmse : study.rel_rmse) {
            points.samples.push_back(static_cast<double>(study.method.samples));
            points.rel_rmse.push_back(rmse);
        }
    }
    return points;
}

/// Root mean square error of a single sample, from all points: error times the root of the samples.
double one_sample_error(const Points& points) {
    std::vector<double> errors;
    for (std::size_t i = 0; i < points.samples.size(); ++i) {
        errors.push_back(points.rel_rmse[i] * std::sqrt(points.samples[i]));
    }
    return root_mean_square(errors);
}

/// Root mean square error over seeds against samples, with bars of one standard deviation over seeds.
plot::Curve measured_curve(const std::vector<SeedErrors>& studies, const StudySubject& of, const std::string& label,
                           plot::Colour colour) {
    plot::Curve curve;
    curve.label = label;
    curve.style = plot::Style::points;
    curve.colour = colour;
    for (const auto& study : studies) {
        if (study.method.estimator != of.estimator || study.method.sampling.control_degree != of.control_degree)
            continue;
        const auto each = in_percent(study.rel_rmse);
        const double typical = root_mean_square(each);
        const double deviation = spread_of(each).deviation;
        curve.x.push_back(static_cast<double>(study.method.samples));
        curve.y.push_back(typical);
        // A bar that would reach 0 has no end on a logarithmic axis.
        curve.low.push_back(std::max(typical - deviation, typical / 10));
        curve.high.push_back(typical + deviation);
    }
    return curve;
}

std::string labelled(const char* name, const PowerLaw& law) {
    const int decimals = decimals_of_error(law.half_width);
    return fmt::format("{}: slope {}{:.{}f} ± {:.{}f}", name, law.slope < 0 ? "−" : "", std::abs(law.slope), decimals,
                       law.half_width, decimals);
}

plot::Curve fitted_curve(const PowerLaw& law, const plot::Curve& measured) {
    plot::Curve curve;
    curve.colour = measured.colour;
    for (const double x : {measured.x.front(), measured.x.back()}) {
        curve.x.push_back(x);
        curve.y.push_back(PERCENT * law.factor * std::pow(x, law.slope));
    }
    return curve;
}

}  // namespace

const std::vector<SeedErrors>& Figures::studies() {
    if (!studies_.empty()) return studies_;
    std::vector<StudySubject> subjects;
    for (const std::size_t count : SHARED_COUNTS) subjects.push_back({Estimator::shared, 0, count});
    for (const std::size_t count : PER_PIXEL_COUNTS) subjects.push_back({Estimator::per_pixel, 0, count});
    for (const std::size_t count : SHARED_COUNTS) subjects.push_back({Estimator::shared, CONTROL_DEGREE, count});
    for (const std::size_t count : PER_PIXEL_CONTROL_COUNTS) {
        subjects.push_back({Estimator::per_pixel, CONTROL_DEGREE, count});
    }
    // Fresh samples cost what they number; shared ones next to nothing.
    const auto cost = [](const StudySubject& subject) {
        constexpr double SHARED_COST = 1.0 / 256;
        const auto samples = static_cast<double>(subject.samples);
        return 1 + (subject.estimator == Estimator::shared ? SHARED_COST * samples : samples);
    };
    double total = 0;
    for (const auto& subject : subjects) total += cost(subject);
    double done = 0;
    report_["studies"] = nlohmann::json::array();
    // No seed is used twice: numbers of samples that share their first samples would err together.
    std::uint64_t first = options_.seed + 1;
    (void)exact();
    for (const auto& subject : subjects) {
        RenderOptions method = method_of(subject);
        method.sampling.seed = first;
        const auto show = [&](double part, double whole) {
            if (events_.progress) events_.progress("error over seeds", done + cost(subject) * part / whole, total);
        };
        studies_.push_back(errors_over_seeds(meter_, statistics_, method, options_.seeds, show));
        report_["studies"].push_back(numbers_of(studies_.back(), statistics_.block_sides()));
        first += options_.seeds;
        done += cost(subject);
    }
    return studies_;
}

const SeedErrors& Figures::study_of(const StudySubject& subject) {
    for (const auto& study : studies()) {
        if (study.method.estimator == subject.estimator && study.method.samples == subject.samples &&
            study.method.sampling.control_degree == subject.control_degree) {
            return study;
        }
    }
    throw std::logic_error("no study of " + describe(subject));
}

void Figures::truth() {
    const std::string id = "figure_11";
    if (!wanted(id)) return;
    const ExactPicture& truth = exact();
    auto words = sphere_words(id + ".png");
    words.insert(words.begin(), {"--estimator", "exact"});
    add(id, id + ".png",
        picture_png(renderer_.display().compose(meter_.view(options_.size), truth.light, gain(),
                                                scene_.distribution().exponent)),
        {{"seconds", truth.times.total()},
         {"mean_radiance", gain() * std::ldexp(truth.mean, scene_.distribution().exponent)},
         {"pixels", statistics_.pixels()},
         {"command", command("render", words)}});
}

void Figures::error_images() {
    const std::string id = "figure_12";
    if (!wanted(id)) return;
    const Stopwatch watch;
    (void)exact();
    PanelSheet sheet{.name = id, .title = "Error of each picture against the exact sphere", .panels = {}};
    nlohmann::json panels = nlohmann::json::array();
    for (const auto& [figure, estimator, count] : sphere_figures()) {
        const StudySubject subject{estimator, 0, count};
        const auto errors = meter_.run(method_of(subject)).errors;
        const ErrorParts parts = statistics_.parts_of(errors);
        sheet.panels.push_back({.title = describe(subject),
                                .note = fmt::format("relative RMSE {}", percent(parts.rel_rmse)),
                                .values = statistics_.as_picture(errors),
                                .size = statistics_.size()});
        panels.push_back({{"figure", figure}, {"rel_rmse", parts.rel_rmse}});
    }
    sheet.limit = round_limit(sheet.panels);
    sheet.diverging_label = "error in parts of the exact mean (too dark, too bright)";
    add(id, id + ".svg", panels_svg(sheet),
        {{"limit", sheet.limit},
         {"panels", std::move(panels)},
         {"seed", options_.seed},
         {"seconds", watch.seconds()},
         {"command", own_command(id)}});
}

void Figures::seed_images() {
    const std::string id = "figure_13";
    if (!wanted(id)) return;
    const Stopwatch watch;
    (void)exact();
    const std::string seeds = std::to_string(options_.seeds);
    PanelSheet sheet{.name = id, .title = fmt::format("Bias and noise told apart over {} seeds", seeds), .panels = {}};
    nlohmann::json rows = nlohmann::json::array();
    for (const auto& subject : {SHOWN_SHARED, SHOWN_PER_PIXEL}) {
        const SeedErrors& study = study_of(subject);
        const auto errors = meter_.run(method_of(subject)).errors;
        const double one = statistics_.parts_of(errors).rel_rmse;
        sheet.panels.push_back({.title = describe(subject),
                                .note = fmt::format("one picture: {}", percent(one)),
                                .values = statistics_.as_picture(errors),
                                .size = statistics_.size()});
        sheet.panels.push_back({.title = "mean error of " + seeds + " seeds",
                                .note = fmt::format("RMS {}", percent(study.mean_rms)),
                                .values = statistics_.as_picture(study.mean),
                                .size = statistics_.size()});
        sheet.panels.push_back({.title = "spread over " + seeds + " seeds",
                                .note = fmt::format("RMS {}", percent(study.spread_rms)),
                                .values = statistics_.as_picture(study.spread),
                                .size = statistics_.size(),
                                .map = ColourMap::sequential});
        const double expected = study.spread_rms / std::sqrt(static_cast<double>(options_.seeds));
        rows.push_back({{"estimator", estimator_name(subject.estimator)},
                        {"samples", subject.samples},
                        {"one_picture_rel_rmse", one},
                        {"mean_over_seeds_rms", study.mean_rms},
                        {"spread_over_seeds_rms", study.spread_rms},
                        {"mean_over_seeds_expected_rms", expected}});
    }
    sheet.limit = round_limit(sheet.panels);
    sheet.diverging_label = "error, parts of the exact mean";
    sheet.sequential_label = "standard deviation, parts of the exact mean";
    add(id, id + ".svg", panels_svg(sheet),
        {{"limit", sheet.limit},
         {"rows", std::move(rows)},
         {"seeds", options_.seeds},
         {"seconds", watch.seconds()},
         {"command", own_command(id)}});
}

void Figures::blocks() {
    const std::string id = "figure_14";
    if (!wanted(id)) return;
    const Stopwatch watch;
    plot::Plot plot;
    plot.name = id;
    plot.title = "What is left of the error when neighbouring pixels are averaged";
    plot.x = {.title = "side of the square that is averaged",
              .unit = "pixels",
              .min = 1,
              .max = static_cast<double>(statistics_.block_sides().back()),
              .tick_step = 2,
              .logarithmic = true,
              .tick_format = "%g"};
    plot.y = {.title = "error", .unit = "% of the exact mean", .logarithmic = true, .tick_format = "%g"};
    std::vector<double> sides;
    for (const std::size_t side : statistics_.block_sides()) sides.push_back(static_cast<double>(side));
    nlohmann::json curves = nlohmann::json::array();
    for (const StudySubject& subject : {SHOWN_SHARED, StudySubject{Estimator::shared, 0, 1024},
                                        StudySubject{Estimator::per_pixel, 0, 8}, SHOWN_PER_PIXEL}) {
        const SeedErrors& study = study_of(subject);
        plot.curves.push_back({describe(subject), sides, in_percent(study.block_rms), plot::Style::line_with_points});
        const PowerLaw law = fit_power_law(sides, study.block_rms);
        curves.push_back({{"estimator", estimator_name(subject.estimator)},
                          {"samples", subject.samples},
                          {"side", sides},
                          {"rms", study.block_rms},
                          {"kept", study.block_rms.back() / study.block_rms.front()},
                          {"slope", law.points < 3 ? nlohmann::json() : nlohmann::json(law.slope)}});
    }
    add(id, id + ".svg", plot::svg(plot),
        {{"curves", std::move(curves)},
         {"seeds", options_.seeds},
         {"seconds", watch.seconds()},
         {"command", own_command(id)}});
}

void Figures::convergence() {
    const std::string id = "figure_15";
    if (!wanted(id)) return;
    const Stopwatch watch;
    plot::Plot plot;
    plot.name = id;
    plot.title = "Error against the number of samples";
    plot.x = {.title = "samples of the set (shared), samples of each pixel (fresh)",
              .tick_step = 4,
              .logarithmic = true,
              .tick_format = "%g"};
    plot.y = {.title = "relative RMSE", .unit = "%", .logarithmic = true, .tick_format = "%g"};
    nlohmann::json fits;
    for (const auto& family : FAMILIES) {
        const Points points = points_of(studies(), family.subject);
        const PowerLaw law = fit_power_law(points.samples, points.rel_rmse);
        const std::string label = labelled(family.label, law);
        const plot::Curve measured = measured_curve(studies(), family.subject, label, family.colour);
        plot.curves.push_back(measured);
        plot.curves.push_back(fitted_curve(law, measured));
        fits[family.name] = {{"slope", law.slope},
                             {"half_width_95", law.half_width},
                             {"one_sample_rel_rmse", one_sample_error(points)},
                             {"control_degree", family.subject.control_degree},
                             {"points", law.points}};
    }
    add(id, id + ".svg", plot::svg(plot),
        {{"fits", std::move(fits)},
         {"seeds", options_.seeds},
         {"seconds", watch.seconds()},
         {"command", own_command(id)}});
}

}  // namespace clerestory
