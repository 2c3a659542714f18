#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

/// The command line as plain data, read from the very objects that parse it and print --help, for manual pages and
/// completions.
namespace clerestory::describe {

struct Flag {
    std::vector<std::string> names;    ///< "-n", "--samples"; of a positional its name alone
    std::string value;                 ///< what stands for the value, such as DEGREES; empty where it takes none
    std::vector<std::string> choices;  ///< the only values, where they are few
    std::string range;                 ///< of numbers, in words
    std::string preset;                ///< value without the flag; empty where there is none
    std::string description;
    std::string group;
    std::vector<std::string> excludes;  ///< long names of flags that it cannot stand beside
    bool repeats = false;
    bool required = false;
    [[nodiscard]] bool takes_value() const noexcept { return !value.empty(); }
    [[nodiscard]] bool takes_file() const noexcept { return value.starts_with("FILE") || value == "DIR"; }
};

struct Command {
    std::string name;  ///< "clerestory" or "render"
    std::string description;
    std::string footer;  ///< examples and what else --help says last
    std::vector<Flag> positionals;
    std::vector<Flag> flags;
    std::vector<Command> commands;
};

/// Reads a program's command line with all its commands.
Command read_command_line(const CLI::App& app);

}  // namespace clerestory::describe
