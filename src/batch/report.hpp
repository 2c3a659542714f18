#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "batch/plan.hpp"
#include "batch/run.hpp"

namespace clerestory {

/// A batch before it runs: every job with its outputs, estimated seconds and memory, and what they come to.
nlohmann::json plan_report(const Plan& plan, const Shard& shard, std::span<const Job> jobs,
                           const BatchOptions& options);

/// A batch that has run: every job with its status, error and seconds by stage, and how many of each there are.
nlohmann::json batch_report(const Plan& plan, const Shard& shard, std::span<const Job> jobs, const BatchResult& result);

/// What shards' reports come to together.
struct MergedReport {
    nlohmann::json report;                ///< as batch_report, of all shards
    std::vector<std::string> incomplete;  ///< a line for everything that is missing or failed; empty where nothing is
};

/// Joins reports of one plan. A job that several reports hold counts as the best of them: tasks that were requeued
/// report twice. Outputs that a report calls done and that do not stand are missing. Throws InputError where a file is
/// no report of a batch, or of another plan than the first: reports come from anywhere, and say what they like.
MergedReport merge_reports(const std::vector<std::filesystem::path>& files);

/// Numbers from `first` to `last`, both of them included.
struct NumberRange {
    std::size_t first;
    std::size_t last;
};
/// The numbers from `first` up to but not `end` that are missing from a sorted list.
std::vector<NumberRange> missing_from(const std::vector<std::size_t>& sorted, std::size_t first, std::size_t end);
/// "0-4, 7, 9-12"; of very many ranges the first, and how many more there are.
std::string ranges_text(const std::vector<NumberRange>& ranges);

}  // namespace clerestory
