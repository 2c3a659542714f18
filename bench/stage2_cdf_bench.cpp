#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <thread>
#include <utility>
#include <vector>

#ifdef CLERESTORY_HAS_BOOST_COMPUTE
#include <boost/compute/algorithm/inclusive_scan.hpp>
#include <boost/compute/container/vector.hpp>
#endif
#ifdef CLERESTORY_HAS_TBB
#include <tbb/global_control.h>
#include <tbb/parallel_scan.h>
#endif

#include "harness.hpp"
#include "map/latlong.hpp"
#include "map/luminance.hpp"
#include "reference/tables.hpp"
#include "scenes.hpp"

namespace clerestory::bench {
namespace {

/// Bytes that the tables of a texel take at least: its radiance read, its end written.
constexpr double BYTES_A_TEXEL = 16;
constexpr double TARGET = 0.6;

/// Rows from top to bottom are those of the reference.
bool tables_right(const LitMap& lit) {
    constexpr std::size_t ROWS = 5;
    const std::size_t width = lit.map.width;
    const auto luminance = luminance_weights_f32(Luminance::average);
    const auto conditional = lit.distribution.conditional.download();
    for (std::size_t k = 0; k < ROWS; ++k) {
        const std::size_t row = k * (lit.map.height - 1) / (ROWS - 1);
        const std::span<const float> rgb(lit.map.rgb.data() + 3 * width * row, 3 * width);
        const auto wanted = reference::row_table(rgb, luminance).end;
        if (!std::equal(wanted.begin(), wanted.end(), conditional.begin() + static_cast<std::ptrdiff_t>(row * width)))
            return false;
    }
    return lit.distribution.marginal.download().back() == TABLE_ONE;
}

/// Tables from float RGB in memory: counts, weights, rows, marginal and guides. Into the arrays of the ones before, so
/// that it is not the system's clearing of new pages that is measured.
void build_tables(benchmark::State& state, std::size_t width) {
    const auto cores = static_cast<unsigned>(state.range(0));
    LitMap& lit = lit_map(Light::even, width, width / 2, cores);
    if (!check(state, tables_right(lit), "tables differ from reference::row_table")) return;
    TableBuilder builder(device_of(cores));
    Work work;
    work.cores = cores;
    work.items = static_cast<double>(width * width / 2);
    work.item = "texel";
    work.ceiling = Ceiling::copy;
    work.amount = BYTES_A_TEXEL * work.items;
    if (cores == all_cores()) work.target_of_ceiling = TARGET;
    time_runs(state, work, [&] { lit.distribution = builder.build(lit.on_device, {}, std::move(lit.distribution)); });
}
BENCHMARK_CAPTURE(build_tables, 1024x512, 1024)->Apply(one_and_all_cores);
BENCHMARK_CAPTURE(build_tables, 2048x1024, 2048)->Apply(one_and_all_cores);
BENCHMARK_CAPTURE(build_tables, 8192x4096, 8192)->Apply(one_and_all_cores);
BENCHMARK_CAPTURE(build_tables, 16384x8192, 16384)->Apply(one_and_all_cores);

constexpr std::size_t SCAN_WIDTH = 8192;
constexpr std::size_t SCAN_TEXELS = SCAN_WIDTH * SCAN_WIDTH / 2;

/// A texel's weight, as all of the scans below take it.
struct Weigh {
    const float* rgb;
    const float* sine;
    float operator()(std::size_t texel) const {
        return (rgb[3 * texel] + rgb[3 * texel + 1] + rgb[3 * texel + 2]) / 3 * sine[texel / SCAN_WIDTH];
    }
};

/// What a user would write instead: one running sum of float weights over the whole map, on that many threads.
///   scan  (weigh, cumulative) fills [SCAN_TEXELS]
template <class Scan>
void scan_weights(benchmark::State& state, Scan scan) {
    const auto cores = static_cast<unsigned>(state.range(0));
    const RadianceMap& map = bench_map(Light::even, SCAN_WIDTH, SCAN_WIDTH / 2);
    const RowGeometry geometry = row_geometry(map.width, map.height);
    const Weigh weigh{map.rgb.data(), geometry.sine.data()};
    std::vector<float> cumulative(SCAN_TEXELS);
    const auto run = [&] { scan(weigh, cumulative, cores); };
    run();
    double sum = 0;
    for (std::size_t texel = 0; texel < SCAN_TEXELS; ++texel) sum += static_cast<double>(weigh(texel));
    // A float running sum stops growing at 2^24 times what is added: it is held to its own start.
    constexpr std::size_t CHECKED = 1000;
    double start = 0;
    for (std::size_t texel = 0; texel < CHECKED; ++texel) start += static_cast<double>(weigh(texel));
    constexpr double TOLERANCE = 1e-4;
    const bool right = std::abs(static_cast<double>(cumulative[CHECKED - 1]) -
                                start)<TOLERANCE * start&& static_cast<double>(cumulative.back())>
                           start && sum > 0;
    if (!check(state, right, "not a running sum")) return;
    Work work;
    work.cores = cores;
    work.items = static_cast<double>(SCAN_TEXELS);
    work.item = "texel";
    work.ceiling = Ceiling::copy;
    work.amount = BYTES_A_TEXEL * work.items;
    time_runs(state, work, run);
}

/// std::inclusive_scan on threads: parts are summed first, then scanned from where the parts before them end.
void std_scan(benchmark::State& state) {
    scan_weights(state, [](const Weigh& weigh, std::vector<float>& cumulative, unsigned threads) {
        std::vector<float> before(threads + 1, 0.0F);
        const auto each = [&](const auto& part) {
            std::vector<std::jthread> others;
            for (unsigned thread = 1; thread < threads; ++thread) others.emplace_back(part, thread);
            part(0U);
        };
        const auto begin = [&](unsigned thread) { return SCAN_TEXELS * thread / threads; };
        if (threads > 1) {
            each([&](unsigned thread) {
                float sum = 0;
                for (std::size_t texel = begin(thread); texel < begin(thread + 1); ++texel) sum += weigh(texel);
                before[thread + 1] = sum;
            });
        }
        std::partial_sum(before.begin(), before.end(), before.begin());
        each([&](unsigned thread) {
            const auto at = [&](std::size_t texel) { return cumulative.begin() + static_cast<std::ptrdiff_t>(texel); };
            for (std::size_t texel = begin(thread); texel < begin(thread + 1); ++texel)
                cumulative[texel] = weigh(texel);
            std::inclusive_scan(at(begin(thread)), at(begin(thread + 1)), at(begin(thread)), std::plus<>(),
                                before[thread]);
        });
    });
}
BENCHMARK(std_scan)->Apply(one_and_all_cores);

#ifdef CLERESTORY_HAS_TBB
void tbb_scan(benchmark::State& state) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(state.range(0)));
    scan_weights(state, [](const Weigh& weigh, std::vector<float>& cumulative, unsigned) {
        tbb::parallel_scan(
            tbb::blocked_range<std::size_t>(0, SCAN_TEXELS), 0.0F,
            [&](const auto& range, float sum, bool is_final) {
                for (std::size_t texel = range.begin(); texel < range.end(); ++texel) {
                    sum += weigh(texel);
                    if (is_final) cumulative[texel] = sum;
                }
                return sum;
            },
            std::plus<>());
    });
}
BENCHMARK(tbb_scan)->Apply(one_and_all_cores);
#endif

#ifdef CLERESTORY_HAS_BOOST_COMPUTE
/// Boost.Compute on the same device, of integers that lie there already: what it costs at the very least.
void boost_scan(benchmark::State& state) {
    const auto cores = static_cast<unsigned>(state.range(0));
    const Device& device = device_of(cores);
    namespace compute = boost::compute;
    const compute::context context(device.context()());
    compute::command_queue queue(device.queue()());
    const std::vector<cl_uint> ones(SCAN_TEXELS, 1);
    compute::vector<cl_uint> from(ones.begin(), ones.end(), queue);
    compute::vector<cl_uint> to(SCAN_TEXELS, context);
    const auto run = [&] {
        compute::inclusive_scan(from.begin(), from.end(), to.begin(), queue);
        queue.finish();
    };
    run();
    cl_uint last = 0;
    compute::copy(to.end() - 1, to.end(), &last, queue);
    if (!check(state, last == SCAN_TEXELS, "not a running sum")) return;
    Work work;
    work.cores = cores;
    work.items = static_cast<double>(SCAN_TEXELS);
    work.item = "texel";
    work.ceiling = Ceiling::copy;
    work.amount = 2 * sizeof(cl_uint) * work.items;
    time_runs(state, work, run);
}
BENCHMARK(boost_scan)->Apply(one_and_all_cores);
#endif

}  // namespace
}  // namespace clerestory::bench
