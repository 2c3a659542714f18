#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "draw/plot.hpp"
#include "fresnel/fresnel.hpp"

namespace clerestory {

/// Facts and curves under the contract's keys; null where there is no critical angle or no relative error. A
/// reflectance is the shortest decimal number that reads back as its float.
nlohmann::json fresnel_json(const Media& media, const FresnelFacts& facts, const FresnelCurves& curves);

/// The curves, one angle a line: angle_deg,r_parallel,r_perpendicular,r_mean,r_schlick.
std::string fresnel_csv(const FresnelCurves& curves);

/// The four curves with Brewster's and the critical angle marked. `name` leads the SVG's ids.
plot::Plot fresnel_plot(const std::string& name, const Media& media, const FresnelFacts& facts,
                        const FresnelCurves& curves);

}  // namespace clerestory
