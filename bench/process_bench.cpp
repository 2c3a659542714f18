#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "harness.hpp"

extern char** environ;

namespace clerestory::bench {
namespace {

namespace fs = std::filesystem;

/// A folder that is removed in the end.
class ScratchFolder {
  public:
    ScratchFolder() : path_(fs::temp_directory_path() / ("clerestory_bench_" + std::to_string(getpid()))) {
        fs::create_directories(path_);
    }
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    ~ScratchFolder() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    [[nodiscard]] std::string file(const char* name) const { return (path_ / name).string(); }

  private:
    fs::path path_;
};

/// Runs a program to its end, its output thrown away. Returns wall seconds; throws where it fails.
double run_program(std::vector<std::string> words, const std::vector<std::string>& more_environment = {}) {
    std::vector<char*> arguments;
    for (auto& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    std::vector<std::string> kept = more_environment;
    std::vector<char*> environment;
    for (auto& setting : kept) environment.push_back(setting.data());
    for (char** setting = environ; *setting != nullptr; ++setting) environment.push_back(*setting);
    environment.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    const Stopwatch watch;
    pid_t child = 0;
    const int failed = posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environment.data());
    posix_spawn_file_actions_destroy(&actions);
    int status = 0;
    if (failed != 0 || waitpid(child, &status, 0) != child || status != 0) throw std::runtime_error(words[0]);
    return watch.seconds();
}

/// The map that the course used where CLERESTORY_BENCH_MAP names it, else the bundled one.
std::vector<std::string> render_words(const ScratchFolder& scratch) {
    std::vector<std::string> words = {CLERESTORY_PROGRAM, "render"};
    if (const char* map = std::getenv("CLERESTORY_BENCH_MAP")) words.insert(words.end(), {map, "--flip-y"});
    words.insert(words.end(), {"-o", scratch.file("s.exr"), "-o", scratch.file("s.png"), "-q"});
    return words;
}

/// Median wall seconds of a process, as milliseconds; of the other program run in between, where there is one.
void time_process(benchmark::State& state, const std::vector<std::string>& words,
                  const std::vector<std::string>& other = {}) {
    std::vector<double> seconds;
    std::vector<double> others;
    try {
        run_program(words);  // fills the caches of kernels
        for (auto _ : state) {
            seconds.push_back(run_program(words));
            if (!other.empty()) others.push_back(run_program(other));
        }
    } catch (const std::runtime_error& failed) {
        state.SkipWithError(failed.what());
        return;
    }
    report_in_turns(state, seconds, others, 1, "process", 1);
}

constexpr int RUNS = 15;

/// A picture from a map to an EXR and a PNG file, beside the time that oiiotool takes to tell its version.
void render_process(benchmark::State& state) {
    const ScratchFolder scratch;
    auto words = render_words(scratch);
    words.insert(words.end(), {"-n", "1024"});
    time_process(state, words, {"oiiotool", "--version"});
}
BENCHMARK(render_process)->Iterations(RUNS)->UseRealTime()->Unit(benchmark::kMillisecond);

/// The fastest way to 1 % of relative RMSE, chosen by the program itself.
void one_percent_process(benchmark::State& state) {
    const ScratchFolder scratch;
    auto words = render_words(scratch);
    words.insert(words.end(), {"--target-error", "0.01"});
    time_process(state, words);
}
BENCHMARK(one_percent_process)->Iterations(RUNS)->UseRealTime()->Unit(benchmark::kMillisecond);

/// Median milliseconds of the words' first runs on a machine, caches of kernels empty.
void time_first_runs(benchmark::State& state, const ScratchFolder& scratch, const std::vector<std::string>& words) {
    constexpr double TARGET_MS = 3000;
    std::vector<double> seconds;
    for (auto _ : state) {
        const std::string fresh = scratch.file(std::to_string(seconds.size()).c_str());
        try {
            seconds.push_back(run_program(
                words, {"POCL_CACHE_DIR=" + fresh + "/pocl", "CLERESTORY_CACHE_DIR=" + fresh + "/programs"}));
        } catch (const std::runtime_error& failed) {
            state.SkipWithError(failed.what());
            return;
        }
    }
    report_in_turns(state, seconds, {}, 1, "process", 0);
    state.counters["target_rate"] = 1e3 / TARGET_MS;
}

/// The first run on a machine as it is built or installed, kernels compiled ahead.
void first_process(benchmark::State& state) {
    const ScratchFolder scratch;
    auto words = render_words(scratch);
    words.insert(words.end(), {"-n", "1024"});
    time_first_runs(state, scratch, words);
}
BENCHMARK(first_process)->Iterations(3)->UseRealTime()->Unit(benchmark::kMillisecond);

/// The same where none were, as on another kind of processor: a copy of the program with only its maps beside it.
void first_process_compiling(benchmark::State& state) {
    const ScratchFolder scratch;
    auto words = render_words(scratch);
    words.insert(words.end(), {"-n", "1024"});
    const fs::path program = words[0];
    words[0] = scratch.file("clerestory");
    fs::copy_file(program, words[0]);
    fs::create_directory_symlink(program.parent_path() / "data", scratch.file("data"));
    time_first_runs(state, scratch, words);
}
BENCHMARK(first_process_compiling)->Iterations(3)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clerestory::bench
