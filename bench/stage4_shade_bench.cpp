#include <cmath>
#include <numbers>
#include <vector>

#include "harness.hpp"
#include "reference/shade.hpp"
#include "sampling/stage3_sample.hpp"
#include "scenes.hpp"
#include "shading/pixels.hpp"
#include "shading/shared.hpp"
#include "shading/stage4_per_pixel.hpp"
#include "shading/stage4_shade.hpp"

namespace clerestory::bench {
namespace {

constexpr std::size_t SIZE = 511;
/// Two fma, a max and three fma for each pixel and light.
constexpr double FLOP_A_PAIR = 12;
constexpr double TARGET = 0.85;
constexpr std::size_t MOST_CHECKED = 2048;  // lights: the reference is slow

/// A few pixels against the sum in long double.
bool shading_right(const LitMap& lit, const SampleSet& set, const SphereView& view,
                   const Buffer<cl_float>& unit_albedo_radiance) {
    constexpr std::size_t CHECKED = 16;
    constexpr double TOLERANCE = 2e-5;  // of the pixel: float32 sums of positive terms
    const auto direction = set.direction.download();
    const auto pdf = set.pdf.download();
    const auto radiance = set.radiance.download();
    std::vector<reference::Light> lights;
    for (std::size_t k = 0; k < set.count; ++k) {
        lights.push_back(reference::light_of_sample(
            {direction[k], direction[set.count + k], direction[2 * set.count + k]},
            {radiance[k], radiance[set.count + k], radiance[2 * set.count + k]}, pdf[k], set.count));
    }
    const auto normal = view.normal.download();
    const auto planes = unit_albedo_radiance.download();
    for (std::size_t k = 0; k < CHECKED; ++k) {
        const std::size_t at = k * (view.count - 1) / (CHECKED - 1);
        const reference::Vector exact =
            reference::shade({normal[at], normal[view.stride + at], normal[2 * view.stride + at]}, lights);
        for (std::size_t c = 0; c < 3; ++c) {
            const auto wanted = static_cast<double>(exact[c]);
            const double got = std::ldexp(static_cast<double>(planes[c * view.stride + at]), lit.distribution.exponent);
            if (!(std::abs(got - wanted) <= TOLERANCE * wanted)) return false;
        }
    }
    return true;
}

/// A sphere under a photograph, and what draws from that.
struct Scenery {
    explicit Scenery(unsigned cores) : lit(lit_map(Light::city, 1024, 512, cores)), device(device_of(cores)) {}
    LitMap& lit;
    const Device& device;
    SphereView view{device, SIZE};
    Buffer<cl_float> unit_albedo_radiance = view.planes(device);
    Sampler sampler{device, lit.on_device, lit.distribution, {}};
};

/// What a pixel and a light cost, in the flop of the plain sum; groups of pixels need less of it.
Work pairs(unsigned cores, const SphereView& view, std::size_t lights) {
    Work work;
    work.cores = cores;
    work.items = static_cast<double>(view.count * lights);
    work.item = "pair";
    work.ceiling = Ceiling::multiply_add;
    work.amount = FLOP_A_PAIR * work.items;
    if (cores == all_cores()) work.target_of_ceiling = TARGET;
    return work;
}

/// One set of lights for all pixels; the drawing of the set is a small part.
void shade_shared(benchmark::State& state, std::size_t lights) {
    const auto cores = static_cast<unsigned>(state.range(0));
    Scenery s(cores);
    SharedShader shader(s.device);
    shader.shade(s.sampler, s.lit.distribution, s.view, lights, s.unit_albedo_radiance);
    if (lights <= MOST_CHECKED &&
        !check(state, shading_right(s.lit, s.sampler.draw(lights), s.view, s.unit_albedo_radiance),
               "pixels differ from reference::shade"))
        return;
    time_runs(state, pairs(cores, s.view, lights),
              [&] { shader.shade(s.sampler, s.lit.distribution, s.view, lights, s.unit_albedo_radiance); });
}
BENCHMARK_CAPTURE(shade_shared, 64, 64)->Apply(one_and_all_cores);
BENCHMARK_CAPTURE(shade_shared, 1024, 1024)->Apply(one_and_all_cores);
BENCHMARK_CAPTURE(shade_shared, 8192, 8192)->Apply(one_and_all_cores);
BENCHMARK_CAPTURE(shade_shared, 65536, 65536)->Apply(one_and_all_cores);

/// The same sum, every light at every pixel: what groups of pixels are held against.
void shade_every_pair(benchmark::State& state) {
    constexpr std::size_t LIGHTS = 1024;
    const auto cores = static_cast<unsigned>(state.range(0));
    Scenery s(cores);
    const SampleSet set = s.sampler.draw(LIGHTS);
    LightShader shader(s.device, true);
    LightBuffer lights(s.device, LIGHTS);
    shader.weigh(set, std::ldexp(1.0F, -s.lit.distribution.exponent),
                 static_cast<float>(1 / (std::numbers::pi * LIGHTS)), lights);
    const auto run = [&] {
        shader.shade(s.view, lights, false, s.unit_albedo_radiance);
        s.device.finish();
    };
    run();
    if (!check(state, shading_right(s.lit, set, s.view, s.unit_albedo_radiance), "pixels differ from reference::shade"))
        return;
    time_runs(state, pairs(cores, s.view, LIGHTS), run);
}
BENCHMARK(shade_every_pair)->Apply(one_and_all_cores);

/// A set of its own for each pixel: as much drawing as shading. Checked against the shared picture, which is the same
/// light.
void shade_per_pixel(benchmark::State& state) {
    constexpr std::size_t SAMPLES = 32;
    const auto cores = static_cast<unsigned>(state.range(0));
    Scenery s(cores);
    auto shared = s.view.planes(s.device);
    constexpr std::size_t SHARED_SAMPLES = 65536;
    SharedShader(s.device).shade(s.sampler, s.lit.distribution, s.view, SHARED_SAMPLES, shared);
    PerPixelShader shader(s.device, s.lit.on_device, s.lit.distribution, {});
    shader.shade(s.view, SAMPLES, s.unit_albedo_radiance);
    double sum = 0;
    double wanted = 0;
    for (const float value : s.unit_albedo_radiance.download()) sum += static_cast<double>(value);
    for (const float value : shared.download()) wanted += static_cast<double>(value);
    // 6.5 million samples' mean against that of 65536: the latter's error is 1.4 / sqrt(65536), and six of it.
    constexpr double TOLERANCE = 0.033;
    if (!check(state, std::abs(sum - wanted) <= TOLERANCE * wanted, "the mean differs from the shared picture's"))
        return;
    Work work;
    work.cores = cores;
    work.items = static_cast<double>(s.view.count * SAMPLES);
    work.item = "pair";
    time_runs(state, work, [&] { shader.shade(s.view, SAMPLES, s.unit_albedo_radiance); });
}
BENCHMARK(shade_per_pixel)->Apply(one_and_all_cores);

}  // namespace
}  // namespace clerestory::bench
