#include "batch/report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <system_error>
#include <utility>

#include "error.hpp"
#include "render/method.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double NANOSECONDS = 1e9;

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

/// How complete a job is: of two reports the better one counts.
int rank_of(const std::string& status) {
    if (status == "done" || status == "skipped") return 2;
    return status == "failed" ? 1 : 0;
}

/// One report file, checked as far as joining needs it.
class ReportFile {
  public:
    explicit ReportFile(fs::path file) : file_(std::move(file)) {
        std::ifstream in(file_);
        if (!in) throw InputError(fmt::format("{}: cannot be opened; check the path", file_.string()));
        try {
            report_ = json::parse(in);
            plan = report_.at("plan").get<std::string>();
            plan_jobs = report_.at("plan_jobs").get<std::size_t>();
            shards = report_.at("shards").get<std::size_t>();
            if (report_.at("shard").is_number()) present.insert(report_.at("shard").get<std::size_t>());
            if (report_.contains("shards_present")) present = report_.at("shards_present").get<std::set<std::size_t>>();
            seconds = report_.at("seconds").at("total").get<double>();
            for (const json& job : report_.at("jobs")) {
                const auto index = job.at("index").get<std::size_t>();
                job.at("outputs").get<std::vector<std::string>>();
                jobs.emplace(index, std::pair(rank_of(job.at("status").get<std::string>()), job));
            }
        } catch (const json::exception&) {
            throw InputError(fmt::format("{}: is no report of a finished `clerestory batch`", file_.string()));
        }
    }
    void check_same_plan(const ReportFile& first) const {
        if (plan == first.plan && plan_jobs == first.plan_jobs && shards == first.shards) return;
        throw InputError(
            fmt::format("{}: is of another batch than {} (other jobs, maps or number of shards); merge "
                        "reports of one batch",
                        file_.string(), first.file_.string()));
    }
    [[nodiscard]] const json& report() const { return report_; }

    std::string plan;
    std::size_t plan_jobs = 0;
    std::size_t shards = 0;
    std::set<std::size_t> present;
    double seconds = 0;
    std::map<std::size_t, std::pair<int, json>> jobs;

  private:
    fs::path file_;
    json report_;
};

/// Sets done jobs whose files are gone to "lost".
void look_for_outputs(json& job) {
    if (rank_of(job["status"].get<std::string>()) < 2) return;
    for (const auto& output : job["outputs"]) {
        std::error_code error;
        if (fs::exists(output.get<std::string>(), error)) continue;
        job["status"] = "lost";
        job["error"] = fmt::format("{}: was written and is not there any more", output.get<std::string>());
        return;
    }
}

std::size_t count_of(const json& counts, const char* status) { return counts.value(status, std::size_t{0}); }

}  // namespace

std::string ranges_of(const std::vector<std::size_t>& sorted) {
    std::string text;
    for (std::size_t i = 0; i < sorted.size();) {
        std::size_t end = i;
        while (end + 1 < sorted.size() && sorted[end + 1] == sorted[end] + 1) ++end;
        text += fmt::format("{}{}", text.empty() ? "" : ", ", sorted[i]);
        if (end > i) text += fmt::format("-{}", sorted[end]);
        i = end + 1;
    }
    return text;
}

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

MergedReport merge_reports(const std::vector<fs::path>& files) {
    std::vector<ReportFile> reports;
    for (const auto& file : files) {
        reports.emplace_back(file);
        reports.back().check_same_plan(reports.front());
    }
    const ReportFile& first = reports.front();
    std::map<std::size_t, std::pair<int, json>> jobs;
    std::set<std::size_t> present;
    double seconds = 0;
    for (ReportFile& report : reports) {
        seconds += report.seconds;
        present.insert(report.present.begin(), report.present.end());
        for (auto& [index, ranked] : report.jobs) {
            const auto [kept, fresh] = jobs.try_emplace(index, ranked);
            if (!fresh && ranked.first > kept->second.first) kept->second = ranked;
        }
    }

    MergedReport merged;
    json& all = merged.report;
    for (const char* key : {"version", "file", "plan", "plan_jobs", "shards"})
        all[key] = first.report().value(key, json());
    all["shard"] = nullptr;
    all["shards_present"] = present;
    all["seconds"] = {{"total", seconds}};
    all["counts"] = {{"done", 0}, {"skipped", 0}, {"failed", 0}, {"not run", 0}, {"lost", 0}, {"missing", 0}};
    all["jobs"] = json::array();
    std::vector<std::size_t> missing;
    for (std::size_t index = 0; index < first.plan_jobs; ++index) {
        const auto found = jobs.find(index);
        if (found == jobs.end()) {
            missing.push_back(index);
            continue;
        }
        json& job = found->second.second;
        look_for_outputs(job);
        const auto status = job["status"].get<std::string>();
        all["counts"][status] = count_of(all["counts"], status.c_str()) + 1;
        if (rank_of(status) < 2) {
            merged.incomplete.push_back(fmt::format(
                "job {}: {}{}", index, status, job.contains("error") ? ": " + job["error"].get<std::string>() : ""));
        }
        all["jobs"].push_back(std::move(job));
    }
    all["counts"]["missing"] = missing.size();
    for (std::size_t shard = 1; shard <= first.shards; ++shard) {
        if (present.contains(shard)) continue;
        merged.incomplete.push_back(
            fmt::format("shard {0}/{1}: no report; run `clerestory batch {2} --shard {0}/{1} --resume`", shard,
                        first.shards, all["file"].get<std::string>()));
    }
    if (!missing.empty()) merged.incomplete.push_back(fmt::format("jobs {}: in no report", ranges_of(missing)));
    return merged;
}

}  // namespace clerestory
