#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

namespace clerestory {

/// What a report says of its batch.
struct ReportHead {
    std::filesystem::path report;
    std::string version;
    std::string file;  ///< the job file
    std::string plan;
    std::size_t plan_jobs = 0;
    std::size_t shards = 0;
    std::set<std::size_t> present;  ///< shards that it tells of
    double seconds = 0;
};

/// Reads a report of `batch` or `merge`, job by job, so that memory holds no more than is kept of it.
///   each  is given every job's entry; its place in the plan is checked at the end only
/// Throws InputError for what is no such report: every number, word and type that joining needs is checked, and what
/// claims more than a batch may have is refused with its number.
ReportHead read_report(const std::filesystem::path& file,
                       const std::function<void(std::size_t index, nlohmann::json job)>& each);

/// Throws InputError naming both.
void check_same_plan(const ReportHead& report, const ReportHead& first);

/// How complete a job of that status is, or a shard's job that another report has too: the higher one counts.
/// -1: no status of a job.
int rank_of(const std::string& status);

}  // namespace clerestory
