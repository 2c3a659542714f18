#pragma once

#include <string>

#include "describe/command_line.hpp"

namespace clerestory::describe {

/// The manual page of `command` in man(7) macros: the program's own where it is `program`, else that of a subcommand.
///   release  such as "Clerestory 0.1.0"
std::string man_page(const Command& program, const Command& command, const std::string& release);

/// "clerestory" or "clerestory-render".
std::string page_name(const Command& program, const Command& command);

}  // namespace clerestory::describe
