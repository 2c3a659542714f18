#include "render.hpp"

#include <fmt/format.h>

#include <array>
#include <optional>

#include "clock.hpp"
#include "error.hpp"
#include "exact.hpp"
#include "harmonic.hpp"

namespace clerestory {
namespace {

struct EstimatorName {
    Estimator estimator;
    const char* name;
};
constexpr std::array ESTIMATORS = {
    EstimatorName{Estimator::shared, "shared"}, EstimatorName{Estimator::per_pixel, "per-pixel"},
    EstimatorName{Estimator::exact, "exact"}, EstimatorName{Estimator::harmonic, "harmonic"}};

}  // namespace

std::vector<std::string> estimator_names() {
    std::vector<std::string> names;
    for (const auto& [value, name] : ESTIMATORS) names.emplace_back(name);
    return names;
}

std::string estimator_name(Estimator estimator) {
    for (const auto& [value, name] : ESTIMATORS) {
        if (value == estimator) return name;
    }
    return "unknown";
}

Estimator estimator_by_name(const std::string& wanted) {
    for (const auto& [value, name] : ESTIMATORS) {
        if (name == wanted) return value;
    }
    throw UsageError(
        fmt::format("no estimator is named {}: choose one of {}", wanted, fmt::join(estimator_names(), ", ")));
}

struct Renderer::State {
    explicit State(const Device& opened) : device(opened) {}

    const Device& device;
    std::optional<Display> display;
    std::optional<SharedShader> shared;
    std::optional<ExactIntegrator> exact;
    std::optional<HarmonicShader> harmonic;
    std::optional<SphereView> view;
    Buffer<cl_float> white;  ///< kept from one picture to the next, as its pages are

    /// What was made for a scene and a choice of options, and serves every rotation and seed.
    template <class Made, class Options>
    struct Kept {
        std::weak_ptr<const void> scene;
        Options options;
        std::optional<Made> made;

        bool serves(const Scene& wanted, const Options& by) const {
            const auto kept = scene.lock();
            return made && kept && kept == wanted.identity().lock() && options == by;
        }
        template <class... Args>
        Made& remake(const Scene& wanted, const Options& by, Args&&... args) {
            made.reset();
            scene = wanted.identity();
            options = by;
            return made.emplace(std::forward<Args>(args)...);
        }
    };
    Kept<Sampler, SamplingOptions> sampler;
    Kept<PerPixelShader, SamplingOptions> per_pixel;
    Kept<HarmonicLight, HarmonicOptions> light;

    /// The options without what rotate() and reseed() change.
    static SamplingOptions unturned(SamplingOptions options) {
        options.rotate_y_deg = 0;
        options.seed = 0;
        return options;
    }

    /// What draws for the scene by the options, made only where the last one cannot serve.
    template <class Made>
    Made& drawing(Kept<Made, SamplingOptions>& kept, const Scene& scene, const SamplingOptions& options) {
        const SamplingOptions by = unturned(options);
        Made& made = kept.serves(scene, by)
                         ? *kept.made
                         : kept.remake(scene, by, device, scene.device_map(), scene.distribution(), options);
        made.rotate(options.rotate_y_deg);
        made.reseed(options.seed);
        return made;
    }

    const SphereView& view_of(std::size_t size) {
        if (!view || view->size != size) view.emplace(device, size);
        return *view;
    }

    void shade_shared(const Scene& scene, const RenderOptions& options, const SphereView& pixels,
                      Buffer<cl_float>& white, StageSeconds& seconds) {
        Stopwatch watch;
        if (!shared) shared.emplace(device);
        Sampler& drawn_from = drawing(sampler, scene, options.sampling);
        seconds.emplace_back("kernels", watch.lap());
        shared->shade(drawn_from, scene.distribution(), pixels, options.samples, white);
        const double drawing = shared->drawing_seconds();
        seconds.emplace_back("draw", drawing);
        seconds.emplace_back("shade", watch.lap() - drawing);
    }

    void shade_per_pixel(const Scene& scene, const RenderOptions& options, const SphereView& pixels,
                         Buffer<cl_float>& white, StageSeconds& seconds) {
        Stopwatch watch;
        PerPixelShader& shader = drawing(per_pixel, scene, options.sampling);
        seconds.emplace_back("kernels", watch.lap());
        shader.shade(pixels, options.samples, white);
        seconds.emplace_back("shade", watch.lap());
    }

    void integrate(const Scene& scene, const RenderOptions& options, const SphereView& pixels, Buffer<cl_float>& white,
                   StageSeconds& seconds, const ProgressFunction& progress) {
        Stopwatch watch;
        if (!exact) exact.emplace(device);
        seconds.emplace_back("kernels", watch.lap());
        exact->shade(scene.device_map(), scene.distribution(), options.sampling.rotate_y_deg, pixels, white, progress);
        seconds.emplace_back("shade", watch.lap());
    }

    void shade_harmonic(const Scene& scene, const RenderOptions& options, const SphereView& pixels,
                        Buffer<cl_float>& white, StageSeconds& seconds) {
        Stopwatch watch;
        if (!harmonic) harmonic.emplace(device);
        seconds.emplace_back("kernels", watch.lap());
        if (!light.serves(scene, options.harmonic)) {
            light.remake(scene, options.harmonic,
                         harmonic->project(scene.device_map(), scene.distribution(), options.harmonic));
        }
        seconds.emplace_back("project", watch.lap());
        harmonic->shade(*light.made, options.sampling.rotate_y_deg, pixels, white);
        device.finish();
        seconds.emplace_back("shade", watch.lap());
    }
};

Renderer::Renderer(const Device& device) : state_(std::make_unique<State>(device)) {}
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

Display& Renderer::display() {
    if (!state_->display) state_->display.emplace(state_->device);
    return *state_->display;
}

Rendered Renderer::render(const Scene& scene, const RenderOptions& options, const ProgressFunction& progress) {
    State& s = *state_;
    Rendered picture;
    picture.size = options.size;
    Stopwatch watch;
    const SphereView& view = s.view_of(options.size);
    if (s.white.size() != 3 * view.stride) s.white = view.planes(s.device);
    Buffer<cl_float>& white = s.white;
    picture.seconds.emplace_back("view", watch.lap());
    if (scene.distribution().black()) {
        white.fill(0.0F);
    } else {
        switch (options.estimator) {
            case Estimator::shared:
                s.shade_shared(scene, options, view, white, picture.seconds);
                break;
            case Estimator::per_pixel:
                s.shade_per_pixel(scene, options, view, white, picture.seconds);
                break;
            case Estimator::exact:
                s.integrate(scene, options, view, white, picture.seconds, progress);
                break;
            case Estimator::harmonic:
                s.shade_harmonic(scene, options, view, white, picture.seconds);
                break;
        }
    }
    watch.lap();
    picture.rgba = display().compose(view, white, options.albedo * options.scale, scene.distribution().exponent);
    picture.seconds.emplace_back("compose", watch.lap());
    return picture;
}

}  // namespace clerestory
