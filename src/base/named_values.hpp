#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "error.hpp"

namespace clerestory {

/// The values of an enumeration with their names at the command line, in the order in which they are listed.
template <class Value>
class NamedValues {
  public:
    /// `what` they are, for the message of a wrong name: "no WHAT is named ...".
    NamedValues(std::string_view what, std::vector<std::pair<Value, std::string>> values)
        : what_(what), values_(std::move(values)) {}

    [[nodiscard]] std::vector<std::string> names() const {
        std::vector<std::string> all;
        for (const auto& [value, name] : values_) all.push_back(name);
        return all;
    }
    [[nodiscard]] std::string name_of(Value wanted) const {
        for (const auto& [value, name] : values_) {
            if (value == wanted) return name;
        }
        return "unknown";
    }
    /// Throws UsageError.
    [[nodiscard]] Value by_name(std::string_view wanted) const {
        for (const auto& [value, name] : values_) {
            if (name == wanted) return value;
        }
        throw UsageError(fmt::format("no {} is named {}: choose one of {}", what_, wanted, fmt::join(names(), ", ")));
    }

  private:
    std::string what_;
    std::vector<std::pair<Value, std::string>> values_;
};

}  // namespace clerestory
