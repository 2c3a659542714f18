#pragma once

#include <CLI/CLI.hpp>

/// One function a command: adds it to the program's command line; its work is done when the line is parsed.
namespace clerestory::commands {

void add_devices(CLI::App& app);
void add_fresnel(CLI::App& app);
void add_sample(CLI::App& app);
void add_render(CLI::App& app);
void add_sheet(CLI::App& app);
void add_info(CLI::App& app);
void add_compare(CLI::App& app);
void add_study(CLI::App& app);
void add_reproduce(CLI::App& app);

}  // namespace clerestory::commands
