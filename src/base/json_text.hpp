#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace clerestory {

/// A report as a file holds it. A name that is no UTF-8 has its wrong bytes shown as U+FFFD: files may be called so.
///   indent  spaces a level; -1: one line
inline std::string json_text(const nlohmann::json& report, int indent = 2) {
    return report.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace) + (indent < 0 ? "" : "\n");
}

}  // namespace clerestory
