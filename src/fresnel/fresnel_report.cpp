#include "fresnel/fresnel_report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

namespace clerestory {
namespace {

/// Shortest decimals of floats, as doubles: 0.04, not 0.03999999910593033.
std::vector<double> shortest(const std::vector<float>& values) {
    std::vector<double> decimals;
    decimals.reserve(values.size());
    for (const float value : values) decimals.push_back(std::stod(fmt::format("{}", value)));
    return decimals;
}

std::vector<double> widened(const std::vector<float>& values) { return {values.begin(), values.end()}; }

}  // namespace

nlohmann::json fresnel_json(const Media& media, const FresnelFacts& facts, const FresnelCurves& curves) {
    nlohmann::json report = {{"ior_incident", media.ior_incident},
                             {"ior_transmitted", media.ior_transmitted},
                             {"r0", facts.r0},
                             {"brewster_deg", facts.brewster_deg},
                             {"critical_deg", nullptr},
                             {"schlick_max_abs_error", facts.max_abs.error},
                             {"schlick_max_abs_error_deg", facts.max_abs.angle_deg},
                             {"schlick_max_rel_error", nullptr},
                             {"schlick_max_rel_error_deg", nullptr},
                             {"angle_deg", curves.angle_deg},
                             {"r_parallel", shortest(curves.parallel)},
                             {"r_perpendicular", shortest(curves.perpendicular)},
                             {"r_mean", shortest(curves.mean)},
                             {"r_schlick", shortest(curves.schlick)}};
    if (facts.critical_deg) report["critical_deg"] = *facts.critical_deg;
    if (facts.max_rel) {
        report["schlick_max_rel_error"] = facts.max_rel->error;
        report["schlick_max_rel_error_deg"] = facts.max_rel->angle_deg;
    }
    return report;
}

std::string fresnel_csv(const FresnelCurves& curves) {
    std::string text = "angle_deg,r_parallel,r_perpendicular,r_mean,r_schlick\n";
    for (std::size_t i = 0; i < curves.angle_deg.size(); ++i) {
        text += fmt::format("{},{},{},{},{}\n", curves.angle_deg[i], curves.parallel[i], curves.perpendicular[i],
                            curves.mean[i], curves.schlick[i]);
    }
    return text;
}

plot::Plot fresnel_plot(const std::string& name, const Media& media, const FresnelFacts& facts,
                        const FresnelCurves& curves) {
    using plot::Side;
    plot::Plot plot;
    plot.name = name;
    plot.title = fmt::format("Fresnel reflectance of a surface from n = {} to n = {}", media.ior_incident,
                             media.ior_transmitted);
    plot.x = {"angle of incidence", "degrees", 0.0, 90.0, 15.0};
    plot.y = {"reflectance", "", 0.0, 1.0, 0.2};
    plot.curves = {{"parallel", curves.angle_deg, widened(curves.parallel)},
                   {"perpendicular", curves.angle_deg, widened(curves.perpendicular)},
                   {"mean", curves.angle_deg, widened(curves.mean)},
                   {"Schlick", curves.angle_deg, widened(curves.schlick)}};
    plot.marks.push_back({facts.brewster_deg, fmt::format("Brewster's angle {:.2f}°", facts.brewster_deg)});
    if (facts.critical_deg) {
        // Past the critical angle every curve is at the top, so that its right side is free.
        plot.marks.push_back({*facts.critical_deg, fmt::format("critical angle {:.2f}°", *facts.critical_deg),
                              plot::Direction::vertical, Side::after});
    }
    return plot;
}

}  // namespace clerestory
