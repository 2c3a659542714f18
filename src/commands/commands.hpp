#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace clerestory::commands {

/// The whole command line: --version, --help and every command. Manual pages and completions are made from it too.
void describe_program(CLI::App& app);

/// One line for a command line that was not understood, with the word that was most likely meant.
///   words  the command line without the program's name
std::string usage_message(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& words);

/// One function a command: adds it to the program's command line; its work is done when the line is parsed.
void add_devices(CLI::App& app);
void add_fresnel(CLI::App& app);
void add_sample(CLI::App& app);
void add_render(CLI::App& app);
void add_sheet(CLI::App& app);
void add_info(CLI::App& app);
void add_compare(CLI::App& app);
void add_study(CLI::App& app);
void add_reproduce(CLI::App& app);
void add_batch(CLI::App& app);
void add_merge(CLI::App& app);

}  // namespace clerestory::commands
