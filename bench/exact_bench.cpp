#include "shading/exact.hpp"

#include <cmath>

#include "harness.hpp"
#include "reference/irradiance.hpp"
#include "scenes.hpp"
#include "shading/pixels.hpp"

namespace clerestory::bench {
namespace {

constexpr std::size_t SIZE = 511;
/// What adding up every texel for every pixel would take.
constexpr double FLOP_A_PAIR = 12;
constexpr double TARGET = 0.6;

/// One pixel against quadrature texel by texel.
bool integral_right(const LitMap& lit, const SphereView& view, const Buffer<cl_float>& unit_albedo_radiance) {
    constexpr double RESOLUTION = 1e-3;
    constexpr double TOLERANCE = 1e-5;
    const auto normal = view.normal.download();
    const auto planes = unit_albedo_radiance.download();
    const std::size_t at = view.count / 3;
    const auto irradiance = reference::irradiance(
        lit.map, 0, {normal[at], normal[view.stride + at], normal[2 * view.stride + at]}, RESOLUTION);
    for (std::size_t c = 0; c < 3; ++c) {
        const double got = std::ldexp(static_cast<double>(planes[c * view.stride + at]), lit.distribution.exponent);
        const double wanted = irradiance[c] / std::acos(-1.0);
        if (!(std::abs(got - wanted) <= TOLERANCE * wanted)) return false;
    }
    return true;
}

/// The integral over the whole map for every pixel. The rate counts pairs of pixel and texel, though the algorithm
/// goes along the texels' edges and never forms them: its fraction of the multiply-add rate may exceed 1.
void exact(benchmark::State& state) {
    const auto cores = static_cast<unsigned>(state.range(0));
    LitMap& lit = lit_map(Light::city, 1024, 512, cores);
    const Device& device = device_of(cores);
    const SphereView view(device, SIZE);
    auto unit_albedo_radiance = view.planes(device);
    ExactIntegrator integrator(device);
    const auto run = [&] { integrator.shade(lit.on_device, lit.distribution, 0, view, unit_albedo_radiance); };
    run();
    if (!check(state, integral_right(lit, view, unit_albedo_radiance), "a pixel differs from reference::irradiance"))
        return;
    Work work;
    work.cores = cores;
    work.items = static_cast<double>(view.count * lit.map.width * lit.map.height);
    work.item = "pair";
    work.ceiling = Ceiling::multiply_add;
    work.amount = FLOP_A_PAIR * work.items;
    if (cores == all_cores()) work.target_of_ceiling = TARGET;
    time_runs(state, work, run);
}
BENCHMARK(exact)->Apply(one_and_all_cores);

}  // namespace
}  // namespace clerestory::bench
