#pragma once

#include <string>

namespace clerestory::plot {

/// What gnuplot gave for a script.
struct Drawing {
    std::string output;    ///< the picture
    std::string messages;  ///< what the script printed
};

/// Runs gnuplot, the first in PATH's absolute folders, without the user's own settings. Throws OutputError with its
/// words where it is missing or fails.
Drawing run_gnuplot(const std::string& script);

/// A gnuplot string that means what it says: single quotes, one line.
std::string quoted(const std::string& text);

}  // namespace clerestory::plot
