#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "draw/plot.hpp"
#include "measure/error_meter.hpp"
#include "study/measure.hpp"
#include "study/ranking.hpp"

namespace clerestory {

/// A study as a report: keys budget_seconds, seeds, points, slopes, pareto (places in points), words, tables, left_out.
nlohmann::json study_json(const StudyOptions& options, const StudyMeasurements& measured);

/// A line a point, its columns named in the first.
std::string study_csv(const std::vector<StudyPoint>& points);

/// Plots of a study by file name without suffix; those without a point are left out.
std::vector<plot::Plot> study_plots(const StudyMeasurements& measured);

/// Where on the sphere six typical methods err, as SVG.
std::string error_maps(ErrorMeter& meter, const RenderOptions& base);
inline constexpr const char* ERROR_MAPS = "error_maps";

/// Names of all files that a study may write.
std::vector<std::string> study_files();

/// The study's page, which needs no other file; its numbers are those of `report`, whose map, device and version it
/// shows too.
///   pictures  SVG by file name without suffix
std::string study_page(const nlohmann::json& report, const std::map<std::string, std::string>& pictures);

}  // namespace clerestory
