#pragma once

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
/// no report of a batch, or of another plan than the first.
MergedReport merge_reports(const std::vector<std::filesystem::path>& files);

/// "0-4, 7, 9-12"
std::string ranges_of(const std::vector<std::size_t>& sorted);

}  // namespace clerestory
