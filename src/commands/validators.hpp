#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace clerestory::commands {

/// Accepts numbers in [low, high]; NaN and infinities are refused.
CLI::Validator finite_between(double low, double high);

/// Accepts decimal whole numbers in [low, high], whatever zeros lead them; for Option::transform.
CLI::Validator whole_number(std::uint64_t low = 0, std::uint64_t high = std::numeric_limits<std::uint64_t>::max());

/// Accepts one of these words, and asks whether the nearest was meant.
CLI::Validator one_of(const std::vector<std::string>& words);

/// Refuses the empty word, which a shell makes of a variable that is not set.
CLI::Validator not_empty();

/// The same for a file to write, and refuses what looks like a flag: its own value was forgotten.
CLI::Validator output_name();

}  // namespace clerestory::commands
