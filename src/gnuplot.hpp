#pragma once

#include <string>

namespace clerestory::plot {

/// What gnuplot gave for a script.
struct Drawing {
    std::string output;    ///< the picture
    std::string messages;  ///< what the script printed
};

/// Runs gnuplot without the user's own settings. Throws OutputError with its words where it is missing or fails.
Drawing run_gnuplot(const std::string& script);

}  // namespace clerestory::plot
