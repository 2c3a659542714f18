#pragma once

#include <benchmark/benchmark.h>

#include <functional>
#include <string>
#include <vector>

#include "cl/device.hpp"

namespace clerestory::bench {

/// The device, or that many of its cores as a sub-device; opened once and kept to the end of the process. Its kernels'
/// launches are logged.
const Device& device_of(unsigned cores);
/// Cores of the whole device.
unsigned all_cores();

/// What a result is a fraction of.
enum class Ceiling { none, copy, multiply_add, gather };

/// One run of what is measured.
struct Work {
    unsigned cores = 1;         ///< that it keeps busy
    double items = 0;           ///< texels, samples, pairs of pixel and light
    const char* item = "item";  ///< what the items are
    Ceiling ceiling = Ceiling::none;
    double amount = 0;             ///< of what the ceiling is counted in: bytes, flop, loads
    std::size_t table_bytes = 0;   ///< for `gather`: what is loaded from
    double target_of_ceiling = 0;  ///< what the fraction should reach; 0: nothing is set
    double target_rate = 0;        ///< what items a second should
};

/// Times `run`, which returns when its work is done; its answer was checked before. Reports, of the best runs:
///   ms, processor_ms   wall and processor time of a run
///   kernel_ms          of the former, in which kernels of the device ran
///   rate               items a second that the cores would do if they had nothing else to do: by processor time
///   of_ceiling         work a second by processor time over the ceiling, which is measured right before and after
void time_runs(benchmark::State& state, const Work& work, const std::function<void()>& run);

/// Reports wall times of whole runs on all cores that were made in turns with what they are held against: medians,
/// `items` a run, and the fraction of the other's time over theirs, its target.
///   others  empty where there is nothing to hold against
void report_in_turns(benchmark::State& state, const std::vector<double>& seconds, const std::vector<double>& others,
                     double items, const char* item, double target);

/// Ends the benchmark with what is wrong unless `right`; returns `right`.
bool check(benchmark::State& state, bool right, const std::string& wrong);

/// Arguments 1 and all_cores().
void one_and_all_cores(benchmark::internal::Benchmark* benchmark);

}  // namespace clerestory::bench
