#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace clerestory {

/// The page of `reproduce`: every figure beside its caption, command and numbers, and what they show.
///   report    as report.json
///   pictures  by figure id, as Figures::pictures
std::string report_page(const nlohmann::json& report, const std::map<std::string, std::string>& pictures);

}  // namespace clerestory
