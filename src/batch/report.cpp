#include "batch/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include "base/text_escape.hpp"
#include "batch/report_file.hpp"
#include "batch/words.hpp"
#include "render/method.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double NANOSECONDS = 1e9;
constexpr int BEST_RANK = 2;  ///< of rank_of
/// Shards whose command is told, and ranges of numbers.
constexpr std::size_t MOST_LISTED = 20;

json describe_job(const Job& job) {
    const RenderOptions& render = job.recipe.render;
    json described = {{"index", job.index},
                      {"map", job.recipe.map.file},
                      {"rotate_y", job.recipe.map.rotate_y},
                      {"estimator", estimator_name(render.estimator)},
                      {"size", render.size},
                      {"outputs", job.outputs}};
    if (draws_samples(render.estimator)) {
        described["samples"] = render.samples;
        described["sequence"] = sequence_name(render.sampling.sequence);
        described["seed"] = render.sampling.seed;
    }
    return described;
}

json head_of(const Plan& plan, const Shard& shard) {
    return {{"version", CLERESTORY_VERSION}, {"file", plan.file.string()}, {"plan", plan.digest},
            {"plan_jobs", plan.jobs.size()}, {"shard", shard.number},      {"shards", shard.count}};
}

json seconds_of(const StageSeconds& stages) {
    json seconds = json::object();
    for (const auto& [stage, value] : stages) seconds[stage] = value;
    return seconds;
}

/// Sets done jobs whose files are gone to "lost".
void look_for_outputs(json& job) {
    if (rank_of(job["status"].get<std::string>()) < BEST_RANK) return;
    for (const auto& output : job["outputs"]) {
        std::error_code error;
        if (fs::exists(output.get<std::string>(), error)) continue;
        job["status"] = "lost";
        job["error"] = fmt::format("{}: was written and is not there any more", output.get<std::string>());
        return;
    }
}

/// The jobs of several reports, each as the best of them tells it.
class JoinedJobs {
  public:
    void add(std::size_t index, json job) {
        const auto kept = jobs_.find(index);
        if (kept == jobs_.end()) {
            jobs_.emplace(index, std::move(job));
        } else if (status_rank(job) > status_rank(kept->second)) {
            kept->second = std::move(job);
        }
    }

    [[nodiscard]] std::vector<std::size_t> indices() const {
        std::vector<std::size_t> indices;
        indices.reserve(jobs_.size());
        for (const auto& [index, job] : jobs_) indices.push_back(index);
        return indices;
    }

    /// Moves them into the report, which has a batch of `plan_jobs`, with how many of each status there are.
    void move_to(MergedReport& merged, std::size_t plan_jobs) {
        std::map<std::string, std::size_t> counts = {{"done", 0},   {"skipped", 0},
                                                     {"failed", 0}, {"not run", 0},
                                                     {"lost", 0},   {"missing", plan_jobs - jobs_.size()}};
        json::array_t all;
        all.reserve(jobs_.size());
        for (auto& [index, job] : jobs_) {
            look_for_outputs(job);
            const auto status = job["status"].get<std::string>();
            ++counts[status];
            if (rank_of(status) < BEST_RANK) merged.incomplete.push_back(line_of(index, status, job));
            all.push_back(std::move(job));
        }
        merged.report["counts"] = counts;
        merged.report["jobs"] = std::move(all);
    }

  private:
    static int status_rank(const json& job) { return rank_of(job["status"].get_ref<const std::string&>()); }

    static std::string line_of(std::size_t index, const std::string& status, const json& job) {
        constexpr std::size_t MOST_WORDS = 1000;
        const std::string error = job.value("error", std::string());
        return one_line(
            fmt::format("job {}: {}{}{}", index, status, error.empty() ? "" : ": ", shortened(error, MOST_WORDS)));
    }

    std::map<std::size_t, json> jobs_;
};

/// What to type for one shard. The job file's name is whatever the report says, and goes into a shell.
std::string command_of_shard(const std::string& file, std::size_t shard, std::size_t shards) {
    return fmt::format("run `clerestory batch {} --shard {}/{} --resume`", shell_path(file), shard, shards);
}

void tell_missing_shards(const ReportHead& head, std::vector<NumberRange> missing, std::vector<std::string>& lines) {
    std::size_t told = 0;
    std::vector<NumberRange> rest;
    for (NumberRange& range : missing) {
        for (; range.first <= range.last && told < MOST_LISTED; ++range.first, ++told) {
            lines.push_back(fmt::format("shard {}/{}: no report; {}", range.first, head.shards,
                                        command_of_shard(head.file, range.first, head.shards)));
        }
        if (range.first <= range.last) rest.push_back(range);
    }
    if (!rest.empty()) lines.push_back(fmt::format("shards {}: no report either", ranges_text(rest)));
}

}  // namespace

json plan_report(const Plan& plan, const Shard& shard, std::span<const Job> jobs, const BatchOptions& options) {
    json report = head_of(plan, shard);
    report["memory_bytes"] = batch_memory(jobs, options);
    report["jobs"] = json::array();
    double total = 0;
    for (const Job& job : jobs) {
        json described = describe_job(job);
        const double seconds = static_cast<double>(job.cost_ns) / NANOSECONDS;
        described["estimated_seconds"] = seconds;
        described["memory_bytes"] = job.memory_bytes;
        described["map_readable"] = job.map->width != 0;
        total += seconds;
        report["jobs"].push_back(std::move(described));
    }
    report["estimated_seconds"] = total;
    return report;
}

json batch_report(const Plan& plan, const Shard& shard, std::span<const Job> jobs, const BatchResult& result) {
    json report = head_of(plan, shard);
    report["device"] = result.device;
    report["platform"] = result.platform;
    report["stopped"] = result.stopped;
    report["seconds"] = {{"total", result.seconds}};
    report["peak_memory_bytes"] = result.peak_memory_bytes;
    report["counts"] = json::object();
    for (const auto status : {JobStatus::done, JobStatus::skipped, JobStatus::failed, JobStatus::not_run}) {
        report["counts"][status_name(status)] = result.count(status);
    }
    report["jobs"] = json::array();
    for (std::size_t i = 0; i < jobs.size(); ++i) {
        json described = describe_job(jobs[i]);
        const JobResult& job = result.jobs[i];
        described["status"] = status_name(job.status);
        if (job.status == JobStatus::failed) {
            described["error"] = job.error;
            described["exit_code"] = job.exit_code;
        }
        if (!job.seconds.empty()) described["seconds"] = seconds_of(job.seconds);
        report["jobs"].push_back(std::move(described));
    }
    return report;
}

std::vector<NumberRange> missing_from(const std::vector<std::size_t>& sorted, std::size_t first, std::size_t end) {
    std::vector<NumberRange> missing;
    for (const std::size_t number : sorted) {
        if (number > first) missing.push_back({first, number - 1});
        first = number + 1;
    }
    if (end > first) missing.push_back({first, end - 1});
    return missing;
}

std::string ranges_text(const std::vector<NumberRange>& ranges) {
    std::string text;
    for (std::size_t i = 0; i < std::min(ranges.size(), MOST_LISTED); ++i) {
        text += fmt::format("{}{}", text.empty() ? "" : ", ", ranges[i].first);
        if (ranges[i].last > ranges[i].first) text += fmt::format("-{}", ranges[i].last);
    }
    if (ranges.size() > MOST_LISTED) text += fmt::format(" and {} ranges more", ranges.size() - MOST_LISTED);
    return text;
}

MergedReport merge_reports(const std::vector<fs::path>& files) {
    std::optional<ReportHead> first;
    JoinedJobs jobs;
    std::set<std::size_t> present;
    double seconds = 0;
    for (const auto& file : files) {
        const ReportHead head =
            read_report(file, [&](std::size_t index, json job) { jobs.add(index, std::move(job)); });
        if (!first) first = head;
        check_same_plan(head, *first);
        present.insert(head.present.begin(), head.present.end());
        seconds += head.seconds;
    }
    MergedReport merged;
    merged.report = {{"version", first->version}, {"file", first->file},
                     {"plan", first->plan},       {"plan_jobs", first->plan_jobs},
                     {"shards", first->shards},   {"shard", nullptr},
                     {"shards_present", present}, {"seconds", {{"total", seconds}}}};
    const auto missing = missing_from(jobs.indices(), 0, first->plan_jobs);
    jobs.move_to(merged, first->plan_jobs);
    const std::vector<std::size_t> shards(present.begin(), present.end());
    tell_missing_shards(*first, missing_from(shards, 1, first->shards + 1), merged.incomplete);
    if (!missing.empty()) merged.incomplete.push_back(fmt::format("jobs {}: in no report", ranges_text(missing)));
    return merged;
}

}  // namespace clerestory
