#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <atomic>
#include <charconv>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <thread>

#include "base/atomic_file.hpp"
#include "base/available_memory.hpp"
#include "base/clock.hpp"
#include "base/json_text.hpp"
#include "base/standard_streams.hpp"
#include "base/text_escape.hpp"
#include "batch/batch_limits.hpp"
#include "batch/job_file.hpp"
#include "batch/plan.hpp"
#include "batch/report.hpp"
#include "batch/run.hpp"
#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "error.hpp"

namespace clerestory::commands {
namespace {

namespace fs = std::filesystem;

struct BatchCommand {
    Common common;
    std::string file;
    std::string folder;  ///< that outputs start from; empty: the job file's
    std::string shard;   ///< empty: from a Slurm array's variables, else the whole
    double memory_gb = 0;
    bool resume = false;
    bool dry_run = false;
};

// A signal's handler can reach nothing but a global.
std::atomic<int> caught_signal = 0;
static_assert(std::atomic<int>::is_always_lock_free);
extern "C" void on_signal(int signal) { caught_signal = signal; }

/// Catches SIGINT and SIGTERM as long as it lives. The second one of a kind ends the program at once.
class SignalGuard {
  public:
    SignalGuard() {
        struct sigaction action {};
        action.sa_handler = on_signal;
        action.sa_flags = static_cast<int>(SA_RESTART | SA_RESETHAND);
        sigemptyset(&action.sa_mask);
        sigaction(SIGINT, &action, &before_[0]);
        sigaction(SIGTERM, &action, &before_[1]);
    }
    SignalGuard(const SignalGuard&) = delete;
    SignalGuard& operator=(const SignalGuard&) = delete;
    ~SignalGuard() {
        sigaction(SIGINT, &before_[0], nullptr);
        sigaction(SIGTERM, &before_[1], nullptr);
    }
    [[nodiscard]] static bool caught() { return caught_signal != 0; }

  private:
    struct sigaction before_[2]{};
};

/// Large blocks go back to the system when they are freed, and threads share a heap. As glibc does it of itself, each
/// thread keeps a heap, and maps, tables and pictures of several sizes tear holes into it: 1000 pictures of 20 maps
/// took 1.7 times the memory of one.
void keep_memory_flat() {
#ifdef __GLIBC__
    constexpr int LARGE_BLOCK = 1 << 20;
    mallopt(M_ARENA_MAX, 1);
    mallopt(M_MMAP_THRESHOLD, LARGE_BLOCK);
#endif
}

std::string duration(double seconds) {
    constexpr double MINUTE = 60;
    constexpr double HOUR = 3600;
    if (seconds < 2 * MINUTE) return fmt::format("{:.0f} s", seconds);
    if (seconds < 2 * HOUR) return fmt::format("{:.0f} min", seconds / MINUTE);
    return fmt::format("{:.1f} h", seconds / HOUR);
}

/// How far the batch is: one line that is drawn anew on a terminal, now and then a line of its own elsewhere.
class BatchProgress {
  public:
    BatchProgress(const Common& common, std::span<const Job> jobs)
        : common_(common), terminal_(isatty(STDERR_FILENO) == 1), total_(jobs.size()) {
        for (const Job& job : jobs) cost_left_ += static_cast<double>(job.cost_ns);
    }
    void update(const Job& job, const JobResult& result) {
        ++settled_;
        cost_left_ -= static_cast<double>(job.cost_ns);
        if (result.status == JobStatus::done) {
            ++done_;
            cost_done_ += static_cast<double>(job.cost_ns);
        }
        if (result.status == JobStatus::failed) {
            ++failed_;
            line(fmt::format("job {} failed: {}", job.index, result.error), true);
        }
        if (common_.verbose && result.status == JobStatus::done)
            line(fmt::format("{}", fmt::join(job.outputs, " ")), false);
        draw();
    }
    /// A line of its own, above the progress line.
    void line(const std::string& text, bool always) {
        if (common_.quiet && !always) return;
        clear();
        print_to_stderr(one_line(text) + "\n");
    }
    void clear() {
        if (std::exchange(drawn_, false)) print_to_stderr("\r\033[K");
    }

  private:
    void draw() {
        constexpr double TERMINAL_SECONDS = 0.1;
        constexpr double PLAIN_SECONDS = 5;
        const double now = seconds_now();
        if (common_.quiet || now - last_ < (terminal_ ? TERMINAL_SECONDS : PLAIN_SECONDS)) return;
        last_ = now;
        const double elapsed = now - started_;
        std::string text = fmt::format("{}/{} jobs", settled_, total_);
        if (done_ > 0) {
            text += fmt::format("  {:.3g} jobs/s  {} left", static_cast<double>(done_) / elapsed,
                                duration(cost_left_ * elapsed / cost_done_));
        }
        if (failed_ > 0) text += fmt::format("  {} failed", failed_);
        print_to_stderr(fmt::format("{}{}{}", terminal_ ? "\r\033[K" : "", text, terminal_ ? "" : "\n"));
        drawn_ = terminal_;
    }

    const Common& common_;
    bool terminal_;
    std::size_t total_;
    std::size_t settled_ = 0;
    std::size_t done_ = 0;
    std::size_t failed_ = 0;
    double cost_left_ = 0;
    double cost_done_ = 0;
    double started_ = seconds_now();
    double last_ = started_;
    bool drawn_ = false;
};

std::optional<std::size_t> variable(const char* name) {
    const char* text = std::getenv(name);
    if (text == nullptr) return std::nullopt;
    std::size_t value = 0;
    const auto [end, error] = std::from_chars(text, text + std::strlen(text), value);
    if (error != std::errc() || *end != '\0') return std::nullopt;
    return value;
}

/// The part of the whole that this task of a Slurm job array is; the whole outside of one.
Shard shard_of_array_task() {
    const auto id = variable("SLURM_ARRAY_TASK_ID");
    const auto count = variable("SLURM_ARRAY_TASK_COUNT");
    if (!id || !count) return {};
    const std::size_t first = variable("SLURM_ARRAY_TASK_MIN").value_or(0);
    const std::size_t last = variable("SLURM_ARRAY_TASK_MAX").value_or(first + *count - 1);
    const std::size_t step = std::max<std::size_t>(variable("SLURM_ARRAY_TASK_STEP").value_or(1), 1);
    if (*id < first || (last - first) / step + 1 != *count || (*id - first) % step != 0) {
        throw UsageError(
            "the tasks of this Slurm array are no even row of numbers, so they do not say which part this is; "
            "submit --array=1-N, or pass --shard I/N");
    }
    return shard_by_name(shard_name({(*id - first) / step + 1, *count}));
}

void list_plan(const BatchCommand& command, const Plan& plan, const Shard& shard, std::span<const Job> jobs,
               const BatchOptions& options) {
    const nlohmann::json report = plan_report(plan, shard, jobs, options);
    emit_json(command.common, report);
    if (command.common.json == "-") return;
    for (const Job& job : jobs) {
        constexpr double NANOSECONDS = 1e9;
        fmt::print("{:>6}  {:>8.3f} s  {:>8}  {}{}\n", job.index, static_cast<double>(job.cost_ns) / NANOSECONDS,
                   format_bytes(static_cast<double>(job.memory_bytes)),
                   one_line(fmt::format("{}", fmt::join(job.outputs, " "))),
                   job.map->width == 0 ? "  (its map cannot be read)" : "");
    }
    constexpr double CORES_OF_ESTIMATE = 2;
    const double cores = std::max(
        1U, command.common.device.threads != 0 ? command.common.device.threads : std::thread::hardware_concurrency());
    fmt::print("{} jobs{}, about {} on {:.0f} cores, {} of memory\n", jobs.size(),
               shard.count > 1 ? fmt::format(" of shard {}", shard_name(shard)) : "",
               duration(report["estimated_seconds"].get<double>() * CORES_OF_ESTIMATE / cores), cores,
               format_bytes(static_cast<double>(batch_memory(jobs, options))));
}

fs::path report_file(const BatchCommand& command, const Shard& shard) {
    const fs::path folder = command.folder.empty() ? fs::path(command.file).parent_path() : fs::path(command.folder);
    return folder / (shard.count == 1 ? std::string("batch.json")
                                      : fmt::format("batch-{}-of-{}.json", shard.number, shard.count));
}

/// A full disk that made jobs fail may have no room for the report either: with --json it stands elsewhere already.
void keep_report(const BatchCommand& command, const fs::path& file, const nlohmann::json& report) {
    try {
        write_text(file, json_text(report));
    } catch (const OutputError& error) {
        if (command.common.json.empty()) throw;
        warn(command.common, error.what());
    }
}

/// Ends as the shell expects of a program that a signal ended.
void end_by_caught_signal() {
    std::signal(caught_signal, SIG_DFL);
    std::raise(caught_signal);
}

void summarise(const BatchCommand& command, const BatchResult& result) {
    const std::size_t done = result.count(JobStatus::done);
    say(command.common, fmt::format("{} done, {} skipped, {} failed in {:.1f} s ({:.3g} jobs/s)", done,
                                    result.count(JobStatus::skipped), result.count(JobStatus::failed), result.seconds,
                                    static_cast<double>(done) / result.seconds));
    if (result.stopped) {
        warn(command.common,
             fmt::format("stopped with {} jobs not run; go on with --resume", result.count(JobStatus::not_run)));
        end_by_caught_signal();
    }
    if (result.device_failed()) throw DeviceError(result.jobs.front().error);
    if (const std::size_t failed = result.count(JobStatus::failed); failed > 0) {
        throw Mismatch(fmt::format("{} of {} jobs failed", failed, result.jobs.size()));
    }
}

/// The plan, once it is known that neither a picture nor a report will replace a file that is read.
Plan checked_plan(const BatchCommand& command, const Shard& shard) {
    const std::vector<fs::path> reports = {report_file(command, shard), command.common.json};
    Plan plan = make_plan(read_job_file(command.file, command.common.seed), command.folder, reports);
    std::set<fs::path> inputs = {command.file};
    for (const Job& job : plan.jobs) inputs.insert(job.map->file);
    check_files(command.common, {inputs.begin(), inputs.end()}, {report_file(command, shard)});
    return plan;
}

void run(const BatchCommand& command) {
    keep_memory_flat();
    const SignalGuard signals;
    const Shard shard = command.shard.empty() ? shard_of_array_task() : shard_by_name(command.shard);
    const Plan plan = checked_plan(command, shard);
    const std::span<const Job> jobs = jobs_of_shard(plan, shard);
    constexpr double GIGABYTE = 1e9;
    const BatchOptions options{device_options(command.common), command.resume,
                               static_cast<std::size_t>(command.memory_gb * GIGABYTE)};
    if (command.dry_run) return list_plan(command, plan, shard, jobs, options);
    if (shard.count > 1)
        say(command.common, fmt::format("shard {}: {} of {} jobs", shard_name(shard), jobs.size(), plan.jobs.size()));

    BatchProgress progress(command.common, jobs);
    const BatchEvents events{&SignalGuard::caught,
                             [&](const Job& job, const JobResult& result) { progress.update(job, result); },
                             [&](const std::string& text) { progress.line("warning: " + text, true); }};
    const BatchResult result = run_batch(jobs, options, events);
    progress.clear();
    const nlohmann::json report = batch_report(plan, shard, jobs, result);
    emit_json(command.common, report);
    keep_report(command, report_file(command, shard), report);
    summarise(command, result);
}

}  // namespace

void add_batch(CLI::App& app) {
    constexpr double MOST_GIGABYTES = 1e6;
    auto* command = app.add_subcommand("batch", "Render the pictures of a job file in one process, or a part of them");
    auto options = std::make_shared<BatchCommand>();
    command->add_option("JOBS", options->file, "Job file (TOML); docs/batch.md is its reference")->required();
    command->add_option("-o,--output-folder", options->folder, "Folder that outputs' names start from (the job file's)")
        ->type_name("DIR");
    command->add_flag("--resume", options->resume,
                      "Skip jobs whose outputs stand already, of the same map, parameters and code");
    command->add_flag("--dry-run", options->dry_run, "Only list the jobs, with memory and estimated time");
    command
        ->add_option("--shard", options->shard,
                     "Do part I of N, of equal cost; within a Slurm job array it is taken from there")
        ->type_name("I/N");
    command
        ->add_option("--memory", options->memory_gb,
                     "Gigabytes that reading a map, and writing a picture, may take beside the job at work; 0 is a "
                     "tenth of the largest job")
        ->type_name("GB")
        ->check(CLI::Range(0.0, MOST_GIGABYTES))
        ->capture_default_str();
    add_common(*command, options->common,
               "  clerestory batch turntable.toml --resume\n\n"
               "with a job file such as this; a key takes one value or a list:\n"
               "  [defaults]\n"
               "  samples = 1024\n"
               "  [[job]]\n"
               "  map = \"maps/*.exr\"\n"
               "  rotate_y = {from = 0, to = 359, step = 1}\n"
               "  output = [\"out/{map}_{rotation:03}.exr\", \"out/{map}_{rotation:03}.png\"]\n\n"
               "Each job's status is in batch.json beside the outputs (batch-I-of-N.json of a part; see `merge`). " +
                   fmt::format("A batch has at most {} pictures.", batch_limits::MOST_PICTURES));
    command->callback([options] { run(*options); });
}

}  // namespace clerestory::commands
