#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "batch/report.hpp"
#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "error.hpp"

namespace clerestory::commands {
namespace {

struct MergeCommand {
    Common common;
    std::vector<std::string> reports;
};

void run(const MergeCommand& command) {
    check_files(command.common, {command.reports.begin(), command.reports.end()});
    const MergedReport merged = merge_reports({command.reports.begin(), command.reports.end()});
    emit_json(command.common, merged.report);
    const nlohmann::json& counts = merged.report["counts"];
    say(command.common,
        fmt::format("{} of {} jobs done", counts["done"].get<std::size_t>() + counts["skipped"].get<std::size_t>(),
                    merged.report["plan_jobs"].get<std::size_t>()));
    if (merged.incomplete.empty()) return;
    for (const auto& line : merged.incomplete) warn(command.common, line);
    throw Mismatch("the batch is not complete");
}

}  // namespace

void add_merge(CLI::App& app) {
    auto* command = app.add_subcommand("merge", "Join the reports of a batch's shards and say what is missing");
    auto options = std::make_shared<MergeCommand>();
    command->add_option("REPORT", options->reports, "Reports that `batch --shard I/N` wrote")->required();
    add_common(*command, options->common, "  clerestory merge out/batch-*-of-4.json --json out/batch.json");
    command->callback([options] { run(*options); });
}

}  // namespace clerestory::commands
