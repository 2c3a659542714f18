#include <algorithm>
#include <cmath>
#include <thread>
#include <vector>

#include "harness.hpp"
#include "reference/draw.hpp"
#include "reference/sequence.hpp"
#include "sampling/stage3_sample.hpp"
#include "scenes.hpp"

namespace clerestory::bench {
namespace {

constexpr std::size_t BATCH = std::size_t{1} << 20;
constexpr double SMALL_TARGET = 200e6;
constexpr double LARGE_TARGET = 40e6;
constexpr std::size_t SMALL_WIDTH = 1024;

/// Cache lines of tables and map that a draw needs at least: its row's guide, its row's ends, its texel. All else is
/// small enough for a core's own cache.
/// On a 1024x512 map a full record took 13 to 15 ns of a core, seen by sampling: 2.8 for its point (and waiting for the
/// records before it to leave the core), 3.3 for row and column, 1.2 for the few that need more halvings, 2.2 for
/// direction and density, 2.0 for radiance, 0.6 for storing, the rest between the loops. Loads alone would take 7.
constexpr double LINES_A_DRAW = 3;

/// The first draws are those of the reference.
bool draws_right(const LitMap& lit, const SampleSet& set) {
    constexpr std::size_t CHECKED = 1000;
    constexpr double PDF_TOLERANCE = 1e-6;
    const auto marginal = lit.distribution.marginal.download();
    const auto conditional = lit.distribution.conditional.download();
    const auto texel = set.texel.download();
    const auto pdf = set.pdf.download();
    const reference::TablesView tables{lit.map.width, lit.map.height, marginal, conditional};
    for (cl_uint k = 0; 2 * k < CHECKED; ++k) {
        const auto words = reference::philox4x32_10({k, 0, DOMAIN_SHARED, SEQUENCE_RANDOM}, {1, 0});
        for (std::size_t half = 0; half < 2; ++half) {
            const reference::Drawn wanted = reference::draw(tables, words[2 * half], words[2 * half + 1]);
            const auto exact = static_cast<double>(wanted.pdf);
            if (texel[2 * k + half] != wanted.row * lit.map.width + wanted.column) return false;
            if (std::abs(static_cast<double>(pdf[2 * k + half]) - exact) > PDF_TOLERANCE * exact) return false;
        }
    }
    return true;
}

void draw_samples(benchmark::State& state, Light light, std::size_t width, std::size_t count) {
    const auto cores = static_cast<unsigned>(state.range(0));
    LitMap& lit = lit_map(light, width, width / 2, cores);
    const Device& device = device_of(cores);
    Sampler sampler(device, lit.on_device, lit.distribution, {});
    const std::size_t batch = std::min(count, BATCH);
    const std::size_t drawn = (count + batch - 1) / batch * batch;
    SampleSet set = sampler.allocate(batch);
    const auto draw = [&] {
        for (std::size_t first = 0; first < drawn; first += batch) sampler.draw_into(set, first, drawn);
        device.finish();
    };
    sampler.draw_into(set);
    if (!check(state, draws_right(lit, set), "draws differ from reference::draw")) return;
    Work work;
    work.cores = cores;
    work.items = static_cast<double>(drawn);
    work.item = "sample";
    work.ceiling = Ceiling::gather;
    work.amount = LINES_A_DRAW * work.items;
    work.table_bytes = lit.on_device.radiance.bytes() + lit.distribution.conditional.bytes();
    if (cores == all_cores()) work.target_rate = width == SMALL_WIDTH ? SMALL_TARGET : LARGE_TARGET;
    time_runs(state, work, draw);
}

/// What a user would write: float tables, std::upper_bound, a full record a sample.
class UpperBoundSampler {
  public:
    struct Record {
        std::uint32_t row, column;
        float x, y, z, pdf, r, g, b;
    };

    explicit UpperBoundSampler(const RadianceMap& map) : map_(map), conditional_(map.width * map.height) {
        float rows = 0;
        for (std::size_t i = 0; i < map.height; ++i) {
            const float theta = PI * (static_cast<float>(i) + 0.5F) / static_cast<float>(map.height);
            float sum = 0;
            for (std::size_t j = 0; j < map.width; ++j) {
                const float* texel = map.rgb.data() + 3 * (i * map.width + j);
                sum += (texel[0] + texel[1] + texel[2]) / 3 * std::sin(theta);
                conditional_[i * map.width + j] = sum;
            }
            marginal_.push_back(rows += sum);
        }
    }

    [[nodiscard]] Record draw(float u, float v) const {
        const float at_row = u * marginal_.back();
        const auto row = std::min(std::upper_bound(marginal_.begin(), marginal_.end(), at_row), marginal_.end() - 1);
        const auto i = static_cast<std::size_t>(row - marginal_.begin());
        const auto begin = conditional_.begin() + static_cast<std::ptrdiff_t>(i * map_.width);
        const auto end = begin + static_cast<std::ptrdiff_t>(map_.width);
        const float at_column = v * *(end - 1);
        const auto column = std::min(std::upper_bound(begin, end, at_column), end - 1);
        const auto j = static_cast<std::size_t>(column - begin);
        const float row_start = i == 0 ? 0 : row[-1];
        const float start = j == 0 ? 0 : column[-1];
        const float down = (at_row - row_start) / (*row - row_start);
        const float along = (at_column - start) / (*column - start);
        const float theta = PI * (static_cast<float>(i) + down) / static_cast<float>(map_.height);
        const float phi = 2 * PI * (static_cast<float>(j) + along) / static_cast<float>(map_.width);
        const float area = 2 * PI * PI / static_cast<float>(map_.width * map_.height) * std::sin(theta);
        const float pdf = (*column - start) / marginal_.back() / area;
        const float* texel = map_.rgb.data() + 3 * (i * map_.width + j);
        return {static_cast<std::uint32_t>(i),
                static_cast<std::uint32_t>(j),
                std::sin(theta) * std::cos(phi),
                std::cos(theta),
                std::sin(theta) * std::sin(phi),
                pdf,
                texel[0],
                texel[1],
                texel[2]};
    }

  private:
    static constexpr float PI = 3.14159265F;
    const RadianceMap& map_;
    std::vector<float> conditional_;
    std::vector<float> marginal_;
};

void draw_by_upper_bound(benchmark::State& state, Light light, std::size_t width) {
    const auto threads = static_cast<unsigned>(state.range(0));
    const RadianceMap& map = bench_map(light, width, width / 2);
    const UpperBoundSampler sampler(map);
    std::vector<UpperBoundSampler::Record> records(BATCH);
    const auto part = [&](unsigned thread) {
        for (std::size_t k = thread; k < BATCH; k += threads) {
            records[k] = sampler.draw(hashed_fraction(2 * k), hashed_fraction(2 * k + 1));
        }
    };
    const auto draw = [&] {
        std::vector<std::jthread> others;
        for (unsigned thread = 1; thread < threads; ++thread) others.emplace_back(part, thread);
        part(0);
    };
    draw();
    const auto of_map = [&](const auto& r) { return map.rgb[3 * (r.row * map.width + r.column)] == r.r; };
    if (!check(state, std::all_of(records.begin(), records.end(), of_map), "a record is not of its texel")) return;
    Work work;
    work.cores = threads;
    work.items = static_cast<double>(BATCH);
    work.item = "sample";
    time_runs(state, work, draw);
}

#define DRAW(light, width)                                                                                  \
    BENCHMARK_CAPTURE(draw_by_upper_bound, light##_##width, Light::light, width)->Apply(one_and_all_cores); \
    BENCHMARK_CAPTURE(draw_samples, light##_##width, Light::light, width, BATCH)->Apply(one_and_all_cores)
DRAW(even, 1024);
DRAW(city, 1024);
DRAW(suns, 1024);
DRAW(even, 8192);
DRAW(city, 8192);
DRAW(suns, 8192);

/// Whether a sample costs the same however many are drawn: batch after batch into the same memory.
void on_all_cores(benchmark::internal::Benchmark* benchmark) {
    benchmark->ArgName("cores")->Arg(all_cores())->UseRealTime()->Unit(benchmark::kMillisecond);
}
#define DRAW_COUNT(count)                                                                                         \
    BENCHMARK_CAPTURE(draw_samples, city_1024_##count, Light::city, SMALL_WIDTH, static_cast<std::size_t>(count)) \
        ->Apply(on_all_cores)
DRAW_COUNT(1e5);
DRAW_COUNT(1e6);
DRAW_COUNT(1e7);
DRAW_COUNT(1e8);
DRAW_COUNT(1e9);

}  // namespace
}  // namespace clerestory::bench
