#include "shading/harmonic.hpp"

#include <cmath>

#include "harness.hpp"
#include "scenes.hpp"
#include "shading/exact.hpp"
#include "shading/pixels.hpp"

namespace clerestory::bench {
namespace {

constexpr std::size_t SIZE = 511;
constexpr HarmonicOptions OPTIONS{20, 256};
constexpr double TARGET = 1 / 0.030;  // pictures a second: 30 ms

double relative_rmse(const std::vector<float>& got, const std::vector<float>& truth) {
    double squares = 0;
    double sum = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
        const double difference = static_cast<double>(got[i]) - static_cast<double>(truth[i]);
        squares += difference * difference;
        sum += static_cast<double>(truth[i]);
    }
    const auto count = static_cast<double>(got.size());
    return std::sqrt(squares / count) / (sum / count);
}

/// Projection and shading: a picture from a map.
void harmonic(benchmark::State& state) {
    const auto cores = static_cast<unsigned>(state.range(0));
    LitMap& lit = lit_map(Light::city, 1024, 512, cores);
    const Device& device = device_of(cores);
    const SphereView view(device, SIZE);
    auto unit_albedo_radiance = view.planes(device);
    auto truth = view.planes(device);
    HarmonicShader shader(device);
    const auto run = [&] {
        shader.shade(shader.project(lit.on_device, lit.distribution, OPTIONS), 0, view, unit_albedo_radiance);
        device.finish();
    };
    run();
    ExactIntegrator(device).shade(lit.on_device, lit.distribution, 0, view, truth);
    const double error = relative_rmse(unit_albedo_radiance.download(), truth.download());
    constexpr double TOLERANCE = 2e-3;  // degree 20 and 256 lights leave at most 1.4e-3 on photographs
    if (!check(state, error < TOLERANCE, "the picture differs from the exact one")) return;
    Work work;
    work.cores = cores;
    work.items = 1;
    work.item = "picture";
    if (cores == all_cores()) work.target_rate = TARGET;
    time_runs(state, work, run);
    state.counters["rel_rmse"] = error;
}
BENCHMARK(harmonic)->Apply(one_and_all_cores);

}  // namespace
}  // namespace clerestory::bench
