#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <string>
#include <vector>

#include "commands/common.hpp"
#include "sampling/stage3_sample.hpp"

namespace clerestory::commands {

/// How samples are drawn, as the command line says it.
struct DrawOptions {
    std::vector<std::size_t> counts;
    std::string sequence = "random";
    std::string texel = "jitter";
    std::string table_arithmetic = "integer";
};

/// Adds -n, --sequence, --texel and --table-arithmetic.
void add_draw_options(CLI::App& command, DrawOptions& options);

/// Adds --control-degree and sets its default.
void add_control_degree(CLI::App& command, unsigned& degree);

SamplingOptions sampling_of(const DrawOptions& options, const Common& common, double rotate_y);

}  // namespace clerestory::commands
