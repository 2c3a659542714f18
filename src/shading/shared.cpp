#include "shading/shared.hpp"

#include <algorithm>

#include "base/clock.hpp"

namespace clerestory {
namespace {

// Samples of a batch: 36 MB of records, which bounds the memory of any count.
constexpr std::size_t BATCH = std::size_t{1} << 20;

}  // namespace

void SharedShader::shade(Sampler& sampler, const Distribution& distribution, const SphereView& view, std::size_t count,
                         Floats& unit_albedo_radiance, const ControlVariate& control) {
    drawing_seconds_ = 0;
    control.check(sampler.options());
    SampleSet set;
    LightBuffer lights;
    HarmonicCoefficients drawn;
    for (std::size_t first = 0; first < count; first += BATCH) {
        const std::size_t batch = std::min(BATCH, count - first);
        const Stopwatch drawing;
        if (set.count != batch) {
            set = sampler.allocate(batch);
            lights = LightBuffer(device_, batch);
        }
        sampler.draw_into(set, first, count);
        shader_.weigh(set, map_scale(distribution), sample_share(count), lights);
        device_.finish();
        drawing_seconds_ += drawing.seconds();
        shader_.shade(view, lights, first > 0, unit_albedo_radiance);
        if (control) control.shader->project(lights, control.map->degree, drawn);
    }
    // Every sample counts c_L less, c_L the clamped cosine's series; over the whole set that is the set's own
    // harmonics.
    if (control)
        control.shader->add_difference(*control.map, sampler.options().rotate_y_deg, drawn, view, unit_albedo_radiance);
    device_.finish();
}

}  // namespace clerestory
