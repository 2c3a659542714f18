#include <array>
#include <cmath>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"
#include "harness.hpp"
#include "sampling/stage3_sample.hpp"

namespace clerestory::bench {
namespace {

constexpr std::size_t COUNT = std::size_t{1} << 20;

/// Six standard errors of the mean of COUNT random fractions: 0.29 / sqrt(COUNT) each.
constexpr double MEAN_TOLERANCE = 0.0017;

/// Points alone, without anything drawn from them: what a sequence costs.
void write_points(benchmark::State& state, Sequence sequence) {
    const auto cores = static_cast<unsigned>(state.range(0));
    const Device& device = device_of(cores);
    const Program program(device, "sequence.cl", fmt::format("-DSEQUENCE={}u", static_cast<cl_uint>(sequence)));
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
    if (!check(state, std::abs(mean - 0.5) <= MEAN_TOLERANCE, "the points' mean is not a half")) return;
    Work work;
    work.cores = cores;
    work.items = static_cast<double>(COUNT);
    work.item = "point";
    time_runs(state, work, run);
}
BENCHMARK_CAPTURE(write_points, random, Sequence::random)->Apply(one_and_all_cores);
BENCHMARK_CAPTURE(write_points, stratified, Sequence::stratified)->Apply(one_and_all_cores);
BENCHMARK_CAPTURE(write_points, sobol, Sequence::sobol)->Apply(one_and_all_cores);

}  // namespace
}  // namespace clerestory::bench
