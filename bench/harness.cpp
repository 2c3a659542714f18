#include "harness.hpp"

#include <algorithm>
#include <map>
#include <memory>

#include "base/clock.hpp"
#include "ceilings.hpp"
#include "processor_time.hpp"

namespace clerestory::bench {
namespace {

constexpr double NANO = 1e-9;
constexpr double MILLI = 1e-3;

std::unique_ptr<Device> open_device(unsigned cores) {
    DeviceOptions options;
    options.threads = cores;
    return std::make_unique<Device>(options, DeviceHooks{.kernel_log = std::make_shared<KernelLog>()});
}

double ceiling_of(const Work& work) {
    switch (work.ceiling) {
        case Ceiling::copy:
            return copy_bandwidth(work.cores);
        case Ceiling::multiply_add:
            return multiply_add_rate(work.cores);
        case Ceiling::gather:
            return gather_rate(work.cores, work.table_bytes);
        case Ceiling::none:
            break;
    }
    return 0;
}

/// Seconds that logged kernels ran.
double kernel_seconds(const KernelLog& log) {
    double seconds = 0;
    for (const KernelRun& run : log) {
        const auto start = run.event.getProfilingInfo<CL_PROFILING_COMMAND_START>();
        const auto end = run.event.getProfilingInfo<CL_PROFILING_COMMAND_END>();
        seconds += NANO * static_cast<double>(end - start);
    }
    return seconds;
}

struct Best {
    double wall = 1e30;
    double processor = 1e30;
    double kernel = 1e30;
};

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

}  // namespace

unsigned all_cores() {
    static const unsigned units = Device().info().compute_units;
    return units;
}

const Device& device_of(unsigned cores) {
    static std::map<unsigned, std::unique_ptr<Device>> open;
    auto& device = open[cores];
    if (!device) device = open_device(cores);
    return *device;
}

void time_runs(benchmark::State& state, const Work& work, const std::function<void()>& run) {
    double ceiling = ceiling_of(work);
    KernelLog& log = *device_of(work.cores).kernel_log();
    Best best;
    for (auto _ : state) {
        log.clear();
        const double processor = process_seconds();
        const Stopwatch watch;
        run();
        best.wall = std::min(best.wall, watch.seconds());
        best.processor = std::min(best.processor, process_seconds() - processor);
        best.kernel = std::min(best.kernel, kernel_seconds(log));
    }
    log.clear();
    ceiling = std::max(ceiling, ceiling_of(work));
    state.counters["cores"] = work.cores;
    state.counters["ms"] = best.wall / MILLI;
    state.counters["processor_ms"] = best.processor / MILLI;
    if (best.kernel > 0) state.counters["kernel_ms"] = best.kernel / MILLI;
    const double seconds = best.processor / work.cores;
    state.counters["rate"] = work.items / seconds;
    if (ceiling > 0) {
        state.counters["ceiling"] = ceiling;
        state.counters["of_ceiling"] = work.amount / seconds / ceiling;
    }
    if (work.target_of_ceiling > 0) state.counters["target_of_ceiling"] = work.target_of_ceiling;
    if (work.target_rate > 0) state.counters["target_rate"] = work.target_rate;
    state.SetLabel(work.item);
}

void report_in_turns(benchmark::State& state, const std::vector<double>& seconds, const std::vector<double>& others,
                     double items, const char* item, double target) {
    const double own = median(seconds);
    state.counters["cores"] = all_cores();
    state.counters["ms"] = own / MILLI;
    if (!others.empty()) {
        const double other = median(others);
        state.counters["ceiling"] = items / other;
        state.counters["of_ceiling"] = other / own;
        state.counters["target_of_ceiling"] = target;
    }
    state.counters["rate"] = items / own;
    state.SetLabel(item);
}

bool check(benchmark::State& state, bool right, const std::string& wrong) {
    if (!right) state.SkipWithError(wrong.c_str());
    return right;
}

void one_and_all_cores(benchmark::internal::Benchmark* benchmark) {
    benchmark->ArgName("cores")->Arg(1);
    if (all_cores() > 1) benchmark->Arg(all_cores());
    benchmark->UseRealTime()->Unit(benchmark::kMillisecond);
}

}  // namespace clerestory::bench
