#pragma once

#include <string>
#include <vector>

namespace clerestory {

/// What a program did that was run to its end.
struct ChildResult {
    int exit_status = 0;   ///< where no signal ended it
    int signal = 0;        ///< the one that ended it, or 0
    std::string output;    ///< what it wrote to stdout
    std::string messages;  ///< what it wrote to stderr
    /// "exit status 1" or "signal 11 (Segmentation fault)".
    [[nodiscard]] std::string ending() const;
};

/// Runs a program to its end, in the root folder: what it may look for beside itself is not the user's.
///   words      absolute path and arguments
///   variables  its whole environment, NAME=value
///   input      what it reads from stdin
/// Throws OutputError where it cannot be started.
ChildResult run_child(std::vector<std::string> words, std::vector<std::string> variables, const std::string& input);

}  // namespace clerestory
