#include "render/renderer.hpp"

#include <list>
#include <optional>
#include <utility>

#include "base/clock.hpp"
#include "sampling/stage3_sample.hpp"
#include "shading/exact.hpp"
#include "shading/shared.hpp"
#include "shading/stage4_per_pixel.hpp"

namespace clerestory {

// Parts of Renderer::State, which no unnamed namespace may hold where several files are compiled as one.

/// What was made of one scene by several options, the last used first.
template <class Made, class Options>
class CachedOfScene {
  public:
    /// What `make` makes of these options, made only where none stands already; good until the next call.
    template <class Make>
    Made& get(const Scene& scene, const Options& options, const Make& make) {
        const auto of = scene_.lock();
        if (!of || of != scene.identity().lock()) entries_.clear();
        scene_ = scene.identity();
        for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
            if (!(entry->first == options)) continue;
            entries_.splice(entries_.begin(), entries_, entry);
            return entries_.front().second;
        }
        constexpr std::size_t MOST = 32;  // more than any command goes through in turns
        if (entries_.size() == MOST) entries_.pop_back();
        return entries_.emplace_front(options, make()).second;
    }
    void forget(const Options& options) noexcept {
        entries_.remove_if([&](const auto& entry) { return entry.first == options; });
    }

  private:
    std::weak_ptr<const void> scene_;
    std::list<std::pair<Options, Made>> entries_;
};

struct Renderer::State {
    explicit State(const Device& opened) : device(opened) {}

    const Device& device;
    std::optional<Display> display;
    std::optional<SharedShader> shared;
    std::optional<ExactIntegrator> exact;
    std::optional<HarmonicShader> harmonic;
    std::optional<SphereView> view;
    Buffer<cl_float> unit_albedo_radiance;  ///< kept from one picture to the next, as its pages are
    CachedOfScene<Sampler, SamplingOptions> samplers;
    CachedOfScene<PerPixelShader, SamplingOptions> per_pixel;
    CachedOfScene<ProjectedMap, HarmonicOptions> projections;

    /// What draws for the scene by the options; rotations and seeds share one.
    template <class Made>
    Made& drawing(CachedOfScene<Made, SamplingOptions>& cached, const Scene& scene, const SamplingOptions& options) {
        SamplingOptions by = options;
        by.rotate_y_deg = 0;
        by.seed = 0;
        Made& made =
            cached.get(scene, by, [&] { return Made(device, scene.device_map(), scene.distribution(), options); });
        made.rotate(options.rotate_y_deg);
        made.reseed(options.seed);
        return made;
    }

    HarmonicShader& harmonics() {
        if (!harmonic) harmonic.emplace(device);
        return *harmonic;
    }

    const ProjectedMap& projection(const Scene& scene, const HarmonicOptions& options) {
        return projections.get(scene, options,
                               [&] { return harmonics().project(scene.device_map(), scene.distribution(), options); });
    }

    ControlVariate control(const Scene& scene, const SamplingOptions& options) {
        check_control_degree(options.control_degree);
        if (options.control_degree == 0) return {};
        return {&harmonics(), &projection(scene, {options.control_degree, 0})};
    }

    StageSeconds shade_shared(const Scene& scene, const RenderOptions& options, const SphereView& pixels,
                              Buffer<cl_float>& light) {
        StageSeconds seconds;
        Stopwatch watch;
        if (!shared) shared.emplace(device);
        Sampler& sampler = drawing(samplers, scene, options.sampling);
        seconds.emplace_back("kernels", watch.lap());
        const ControlVariate of = control(scene, options.sampling);
        if (of) seconds.emplace_back("project", watch.lap());
        shared->shade(sampler, scene.distribution(), pixels, options.samples, light, of);
        seconds.emplace_back("draw", shared->drawing_seconds());
        seconds.emplace_back("shade", watch.lap() - shared->drawing_seconds());
        return seconds;
    }

    StageSeconds shade_per_pixel(const Scene& scene, const RenderOptions& options, const SphereView& pixels,
                                 Buffer<cl_float>& light) {
        StageSeconds seconds;
        Stopwatch watch;
        PerPixelShader& shader = drawing(per_pixel, scene, options.sampling);
        seconds.emplace_back("kernels", watch.lap());
        const ControlVariate of = control(scene, options.sampling);
        if (of) seconds.emplace_back("project", watch.lap());
        shader.shade(pixels, options.samples, light, of);
        seconds.emplace_back("shade", watch.lap());
        return seconds;
    }

    StageSeconds integrate(const Scene& scene, const RenderOptions& options, const SphereView& pixels,
                           Buffer<cl_float>& light, const ProgressFunction& progress) {
        StageSeconds seconds;
        Stopwatch watch;
        if (!exact) exact.emplace(device);
        seconds.emplace_back("kernels", watch.lap());
        exact->shade(scene.device_map(), scene.distribution(), options.sampling.rotate_y_deg, pixels, light, progress);
        seconds.emplace_back("shade", watch.lap());
        return seconds;
    }

    StageSeconds shade_harmonic(const Scene& scene, const RenderOptions& options, const SphereView& pixels,
                                Buffer<cl_float>& light) {
        StageSeconds seconds;
        Stopwatch watch;
        HarmonicShader& shader = harmonics();
        seconds.emplace_back("kernels", watch.lap());
        const ProjectedMap& map = projection(scene, options.harmonic);
        seconds.emplace_back("project", watch.lap());
        shader.shade(map, options.sampling.rotate_y_deg, pixels, light);
        device.finish();
        seconds.emplace_back("shade", watch.lap());
        return seconds;
    }
};

Renderer::Renderer(const Device& device) : state_(std::make_unique<State>(device)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

const Device& Renderer::device() const noexcept { return state_->device; }

Display& Renderer::display() {
    if (!state_->display) state_->display.emplace(state_->device);
    return *state_->display;
}

const ProjectedMap& Renderer::projection(const Scene& scene, const HarmonicOptions& options) {
    return state_->projection(scene, options);
}

void Renderer::forget_projection(const HarmonicOptions& options) noexcept { state_->projections.forget(options); }

StageSeconds Renderer::shade(const Scene& scene, const RenderOptions& options, const SphereView& view,
                             Buffer<cl_float>& unit_albedo_radiance, const ProgressFunction& progress) {
    State& s = *state_;
    switch (options.estimator) {
        case Estimator::shared:
            return s.shade_shared(scene, options, view, unit_albedo_radiance);
        case Estimator::per_pixel:
            return s.shade_per_pixel(scene, options, view, unit_albedo_radiance);
        case Estimator::harmonic:
            return s.shade_harmonic(scene, options, view, unit_albedo_radiance);
        case Estimator::exact:
            break;
    }
    return s.integrate(scene, options, view, unit_albedo_radiance, progress);
}

Rendered Renderer::render(const Scene& scene, const RenderOptions& options, const ProgressFunction& progress) {
    State& s = *state_;
    Rendered picture;
    picture.size = options.size;
    Stopwatch watch;
    if (!s.view || s.view->size != options.size) s.view.emplace(s.device, options.size);
    if (s.unit_albedo_radiance.size() != 3 * s.view->stride) s.unit_albedo_radiance = s.view->planes(s.device);
    picture.seconds.emplace_back("view", watch.lap());
    if (scene.distribution().black()) {
        s.unit_albedo_radiance.fill(0.0F);
    } else {
        const StageSeconds stages = shade(scene, options, *s.view, s.unit_albedo_radiance, progress);
        picture.seconds.insert(picture.seconds.end(), stages.begin(), stages.end());
    }
    watch.lap();
    picture.rgba = display().compose(*s.view, s.unit_albedo_radiance, options.albedo * options.scale,
                                     scene.distribution().exponent);
    picture.seconds.emplace_back("compose", watch.lap());
    return picture;
}

}  // namespace clerestory
