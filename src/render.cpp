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

    const SphereView& view_of(std::size_t size) {
        if (!view || view->size != size) view.emplace(device, size);
        return *view;
    }

    void shade_shared(const Scene& scene, const RenderOptions& options, const SphereView& pixels,
                      Buffer<cl_float>& white, StageSeconds& seconds) {
        Stopwatch watch;
        if (!shared) shared.emplace(device);
        Sampler sampler(device, scene.device_map(), scene.distribution(), options.sampling);
        seconds.emplace_back("kernels", watch.lap());
        shared->shade(sampler, scene.distribution(), pixels, options.samples, white);
        const double drawing = shared->drawing_seconds();
        seconds.emplace_back("draw", drawing);
        seconds.emplace_back("shade", watch.lap() - drawing);
    }

    void shade_per_pixel(const Scene& scene, const RenderOptions& options, const SphereView& pixels,
                         Buffer<cl_float>& white, StageSeconds& seconds) {
        Stopwatch watch;
        PerPixelShader shader(device, scene.device_map(), scene.distribution(), options.sampling);
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
        const HarmonicLight light = harmonic->project(scene.device_map(), scene.distribution(), options.harmonic);
        seconds.emplace_back("project", watch.lap());
        harmonic->shade(light, options.sampling.rotate_y_deg, pixels, white);
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
    Buffer<cl_float> white = view.planes(s.device);
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
