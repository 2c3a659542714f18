#include <benchmark/benchmark.h>

#include <array>
#include <cmath>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"
#include "samples.hpp"

namespace clerestory {
namespace {

constexpr std::size_t COUNT = std::size_t{1} << 20;
constexpr std::array NAMES = {"random", "stratified", "sobol"};

/// Six standard errors of the mean of COUNT random fractions: 0.29 / sqrt(COUNT) each.
constexpr double MEAN_TOLERANCE = 0.0017;

/// Points alone, without anything drawn from them: what a sequence costs.
void write_points(benchmark::State& state) {
    const auto sequence = static_cast<cl_uint>(state.range(0));
    const Device device;
    const Program program(device, "sequence.cl", fmt::format("-DSEQUENCE={}u", sequence));
    Kernel<cl_uint, cl_uint, cl_uint, cl_uint, Strata, cl_uint, cl_uint, Buffer<cl_uint>> kernel(device, program,
                                                                                                 "write_points");
    Buffer<cl_uint> point(device, "the points", 2 * COUNT);
    const auto run = [&] {
        kernel({COUNT / 2, device.work_group(256)}, 1U, 0U, DOMAIN_SHARED, 0U, strata(COUNT), 0U,
               static_cast<cl_uint>(COUNT / 2), point);
        device.finish();
    };
    run();
    double mean = 0;
    for (const cl_uint u : point.download()) mean += std::ldexp(u, -32) / (2.0 * COUNT);
    if (std::abs(mean - 0.5) > MEAN_TOLERANCE) return state.SkipWithError("the points' mean is not a half");
    for (auto _ : state) run();
    state.SetLabel(NAMES.at(sequence));
    state.SetItemsProcessed(static_cast<std::int64_t>(COUNT) * static_cast<std::int64_t>(state.iterations()));
}
BENCHMARK(write_points)->DenseRange(0, 2)->UseRealTime()->MeasureProcessCPUTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace clerestory
