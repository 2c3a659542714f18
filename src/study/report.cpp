#include "study/report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "render/method.hpp"

namespace clerestory {
namespace {

using nlohmann::json;

/// What the method is made of; null where it has no such part.
json method_json(const RenderOptions& m) {
    json method = {{"name", method_name(m)}, {"flags", method_flags(m)}, {"estimator", estimator_name(m.estimator)},
                   {"sequence", nullptr},    {"samples", nullptr},       {"control_degree", nullptr},
                   {"degree", nullptr},      {"lights", nullptr}};
    if (draws_samples(m.estimator)) {
        method["sequence"] = sequence_name(m.sampling.sequence);
        method["samples"] = m.samples;
        method["control_degree"] = m.sampling.control_degree;
    }
    if (m.estimator == Estimator::harmonic) {
        method["degree"] = m.harmonic.degree;
        method["lights"] = m.harmonic.lights;
    }
    return method;
}

json point_json(const StudyPoint& p) {
    json point = method_json(p.method);
    point.update({{"seeds", p.seeds},
                  {"rel_rmse", p.rel_rmse},
                  {"rel_rmse_deviation", p.rel_rmse_deviation},
                  {"bias", p.bias},
                  {"bias_noise", p.bias_noise},
                  {"worst", p.worst},
                  {"percentile99", p.percentile99},
                  {"seconds", p.seconds.median},
                  {"seconds_low", p.seconds.low},
                  {"seconds_high", p.seconds.high},
                  {"stages", {{"project", p.stages.project}, {"draw", p.stages.draw}, {"shade", p.stages.shade}}},
                  {"pareto", p.on_front}});
    return point;
}

json slope_json(const StudySlope& s) {
    return {{"estimator", estimator_name(s.estimator)},
            {"sequence", sequence_name(s.sequence)},
            {"control_degree", s.control_degree},
            {"slope", s.law.slope},
            {"half_width", s.law.half_width},
            {"low", s.law.slope - s.law.half_width},
            {"high", s.law.slope + s.law.half_width},
            {"factor", s.law.factor},
            {"points", s.law.points}};
}

json table_json(const StudyTable& t) {
    return {{"arithmetic", name_of(t.report.arithmetic)},
            {"seconds", t.seconds.median},
            {"seconds_low", t.seconds.low},
            {"seconds_high", t.seconds.high},
            {"lit", t.report.lit},
            {"undrawable", t.report.undrawable},
            {"largest_relative_error", t.report.largest_relative_error},
            {"total_variation", t.report.total_variation},
            {"total_relative_error", t.report.total_relative_error}};
}

}  // namespace

json study_json(const StudyOptions& options, const StudyMeasurements& measured) {
    json report = {{"size", options.base.size},
                   {"seed", options.base.sampling.seed},
                   {"seeds", options.seeds},
                   {"budget_seconds", options.budget_seconds},
                   {"measuring_seconds", measured.seconds},
                   {"short_of_seeds", measured.short_of_seeds}};
    for (const char* list : {"points", "pareto", "slopes", "words", "tables", "left_out"}) report[list] = json::array();
    for (std::size_t i = 0; i < measured.points.size(); ++i) {
        report["points"].push_back(point_json(measured.points[i]));
        if (measured.points[i].on_front) report["pareto"].push_back(i);
    }
    for (const auto& slope : fit_slopes(measured.points)) report["slopes"].push_back(slope_json(slope));
    for (const auto& verdict : verdicts(measured.points)) {
        json word = {{"question", verdict.question}, {"sentence", verdict.sentence}, {"point", nullptr}};
        if (verdict.point != nullptr) word["point"] = verdict.point - measured.points.data();
        report["words"].push_back(word);
    }
    for (const auto& table : measured.tables) report["tables"].push_back(table_json(table));
    for (const auto& method : measured.left_out) report["left_out"].push_back(method_json(method));
    return report;
}

std::string study_csv(const std::vector<StudyPoint>& points) {
    std::string text =
        "estimator,sequence,samples,control_degree,degree,lights,seeds,rel_rmse,rel_rmse_deviation,bias,bias_noise,"
        "worst,percentile99,project_seconds,draw_seconds,shade_seconds,seconds,seconds_low,seconds_high,pareto\n";
    for (const StudyPoint& p : points) {
        const RenderOptions& m = p.method;
        text += estimator_name(m.estimator);
        if (draws_samples(m.estimator)) {
            text +=
                fmt::format(",{},{},{},,", sequence_name(m.sampling.sequence), m.samples, m.sampling.control_degree);
        } else if (m.estimator == Estimator::harmonic) {
            text += fmt::format(",,,,{},{}", m.harmonic.degree, m.harmonic.lights);
        } else {
            text += ",,,,,";
        }
        text += fmt::format(",{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", p.seeds, p.rel_rmse, p.rel_rmse_deviation,
                            p.bias, p.bias_noise, p.worst, p.percentile99, p.stages.project, p.stages.draw,
                            p.stages.shade, p.seconds.median, p.seconds.low, p.seconds.high, p.on_front ? 1 : 0);
    }
    return text;
}

}  // namespace clerestory
