#pragma once

#include <string>

#include "describe/command_line.hpp"

namespace clerestory::describe {

/// Scripts that complete commands, flags, the values of those that have few, and files. None needs helpers of its
/// shell's completion package.
std::string bash_completion(const Command& program);
std::string zsh_completion(const Command& program);
std::string fish_completion(const Command& program);

}  // namespace clerestory::describe
