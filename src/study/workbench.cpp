#include "study/workbench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "clock.hpp"
#include "error.hpp"
#include "exact.hpp"
#include "harmonic.hpp"

namespace clerestory {
namespace {

// Enough to go through every kernel that a sampling method has.
constexpr std::size_t WARM_UP_SAMPLES = 8;
// The exact picture's kernels are compiled by one this small.
constexpr std::size_t WARM_UP_SIZE = 16;

bool samples_light(Estimator estimator) { return estimator == Estimator::shared || estimator == Estimator::per_pixel; }

}  // namespace

std::string method_name(const RenderOptions& method) {
    std::string name = estimator_name(method.estimator);
    if (method.estimator == Estimator::harmonic) {
        name += fmt::format(", L = {}, K = {}", method.harmonic.degree, method.harmonic.lights);
    } else if (samples_light(method.estimator)) {
        name += fmt::format(" {}, N = {}", sequence_name(method.sampling.sequence), method.samples);
        if (method.sampling.control_degree > 0) name += fmt::format(", L = {}", method.sampling.control_degree);
    }
    return name;
}

std::string method_flags(const RenderOptions& method) {
    std::string flags = "--estimator " + estimator_name(method.estimator);
    if (method.estimator == Estimator::harmonic) {
        flags += fmt::format(" --degree {} --lights {}", method.harmonic.degree, method.harmonic.lights);
    } else if (samples_light(method.estimator)) {
        flags += fmt::format(" --sequence {} -n {} --control-degree {}", sequence_name(method.sampling.sequence),
                             method.samples, method.sampling.control_degree);
    }
    return flags;
}

double relative_rmse(const std::vector<float>& values) {
    double squares = 0;
    for (const float value : values) squares += static_cast<double>(value) * static_cast<double>(value);
    return values.empty() ? 0 : std::sqrt(squares / static_cast<double>(values.size()));
}

struct Workbench::State {
    /// The exact picture.
    struct Truth {
        std::vector<cl_float> planes;  ///< [3 * stride]
        double mean = 0;
        MethodTimes times;
    };
    /// A sphere of one size, and what is known to be its picture at one rotation.
    struct Sphere {
        Sphere(const Device& device, std::size_t size) : view(device, size), white(view.planes(device)) {}
        SphereView view;
        Buffer<cl_float> white;
        std::map<double, Truth> exact;  ///< by rotation
    };
    /// What a program depends on.
    using DrawKey = std::tuple<cl_uint, unsigned, bool, double>;
    using WarmKey = std::tuple<Estimator, cl_uint, unsigned, std::size_t>;

    State(const Device& opened, const Scene& lit) : device(opened), scene(lit) {}

    const Device& device;
    const Scene& scene;
    std::map<std::size_t, Sphere> spheres;
    std::optional<SharedShader> shared;
    std::optional<HarmonicShader> harmonic;
    std::optional<ExactIntegrator> exact;
    std::map<DrawKey, Sampler> samplers;
    std::map<DrawKey, PerPixelShader> per_pixel;
    std::map<unsigned, double> control_seconds;  ///< of the control variate's projection, by degree
    std::set<WarmKey> warm;

    Sphere& sphere(std::size_t size) { return spheres.try_emplace(size, device, size).first->second; }

    HarmonicShader& harmonics() {
        if (!harmonic) harmonic.emplace(device);
        return *harmonic;
    }
    ExactIntegrator& integrator() {
        if (!exact) exact.emplace(device);
        return *exact;
    }

    static DrawKey draw_key(const SamplingOptions& s) {
        return {static_cast<cl_uint>(s.sequence), s.control_degree, s.place == TexelPlace::jitter, s.rotate_y_deg};
    }
    static WarmKey warm_key(const RenderOptions& m) {
        if (!samples_light(m.estimator)) return {m.estimator, 0, 0, m.size};
        return {m.estimator, static_cast<cl_uint>(m.sampling.sequence), m.sampling.control_degree, m.size};
    }

    /// Samplers and shaders keep their projection from one picture to the next; a single picture has to pay for it.
    double control_projection(unsigned degree) {
        if (degree == 0) return 0;
        constexpr int RUNS = 5;
        const auto [entry, is_new] = control_seconds.try_emplace(degree, std::numeric_limits<double>::infinity());
        for (int k = 0; is_new && k <= RUNS; ++k) {
            const Stopwatch watch;
            (void)harmonics().project(scene.device_map(), scene.distribution(), {degree, 0});
            if (k > 0) entry->second = std::min(entry->second, watch.seconds());  // the first one warms up
        }
        return entry->second;
    }

    MethodTimes shade_shared(const RenderOptions& m, Sphere& on) {
        MethodTimes times;
        times.project = control_projection(m.sampling.control_degree);
        if (!shared) shared.emplace(device);
        Sampler& sampler =
            samplers.try_emplace(draw_key(m.sampling), device, scene.device_map(), scene.distribution(), m.sampling)
                .first->second;
        sampler.reseed(m.sampling.seed);
        if (m.sampling.control_degree > 0) (void)sampler.control(harmonics());
        const Stopwatch watch;
        shared->shade(sampler, scene.distribution(), on.view, m.samples, on.white);
        times.draw = shared->drawing_seconds();
        times.shade = watch.seconds() - times.draw;
        return times;
    }

    MethodTimes shade_per_pixel(const RenderOptions& m, Sphere& on) {
        MethodTimes times;
        times.project = control_projection(m.sampling.control_degree);
        PerPixelShader& shader =
            per_pixel.try_emplace(draw_key(m.sampling), device, scene.device_map(), scene.distribution(), m.sampling)
                .first->second;
        shader.reseed(m.sampling.seed);
        const Stopwatch watch;
        shader.shade(on.view, m.samples, on.white);
        times.shade = watch.seconds();
        return times;
    }

    MethodTimes shade_harmonic(const RenderOptions& m, Sphere& on) {
        MethodTimes times;
        HarmonicShader& shader = harmonics();
        Stopwatch watch;
        const HarmonicLight light = shader.project(scene.device_map(), scene.distribution(), m.harmonic);
        times.project = watch.lap();
        shader.shade(light, m.sampling.rotate_y_deg, on.view, on.white);
        device.finish();
        times.shade = watch.lap();
        return times;
    }

    MethodTimes integrate(const RenderOptions& m, Sphere& on) {
        ExactIntegrator& shader = integrator();
        const Stopwatch watch;
        shader.shade(scene.device_map(), scene.distribution(), m.sampling.rotate_y_deg, on.view, on.white);
        return {0, 0, watch.seconds()};
    }

    MethodTimes shade(const RenderOptions& m, Sphere& on) {
        switch (m.estimator) {
            case Estimator::shared:
                return shade_shared(m, on);
            case Estimator::per_pixel:
                return shade_per_pixel(m, on);
            case Estimator::harmonic:
                return shade_harmonic(m, on);
            case Estimator::exact:
                break;
        }
        return integrate(m, on);
    }

    MethodTimes shade_warm(const RenderOptions& m, Sphere& on) {
        if (warm.insert(warm_key(m)).second) {
            RenderOptions first = m;
            first.samples = std::min(m.samples, WARM_UP_SAMPLES);
            (void)shade(first, on);
        }
        return shade(m, on);
    }

    const Truth& truth(const RenderOptions& m) {
        Sphere& on = sphere(m.size);
        const auto [entry, is_new] = on.exact.try_emplace(m.sampling.rotate_y_deg);
        auto& [planes, mean, times] = entry->second;
        if (is_new) {
            if (!exact) (void)integrate(m, sphere(WARM_UP_SIZE));
            times = integrate(m, on);
            warm.insert({Estimator::exact, 0, 0, m.size});
            planes = on.white.download();
            for (std::size_t c = 0; c < 3; ++c) {
                for (std::size_t i = 0; i < on.view.count; ++i) {
                    mean += static_cast<double>(planes[c * on.view.stride + i]);
                }
            }
            mean /= 3 * static_cast<double>(on.view.count);
        }
        return entry->second;
    }
};

Workbench::Workbench(const Device& device, const Scene& scene) : state_(std::make_unique<State>(device, scene)) {}
Workbench::Workbench(Workbench&&) noexcept = default;
Workbench& Workbench::operator=(Workbench&&) noexcept = default;
Workbench::~Workbench() = default;

double Workbench::exact_mean(const RenderOptions& method) { return state_->truth(method).mean; }

MethodTimes Workbench::exact_times(const RenderOptions& method) { return state_->truth(method).times; }

MethodTimes Workbench::time(const RenderOptions& method) {
    return state_->shade_warm(method, state_->sphere(method.size));
}

MethodRun Workbench::run(const RenderOptions& method) {
    State& s = *state_;
    State::Sphere& on = s.sphere(method.size);
    const auto& [exact, mean, times] = s.truth(method);
    if (!(mean > 0)) {
        throw InputError(
            "no light of the map reaches the side of the sphere that is seen, so that there is no relative error: turn "
            "the map with --rotate-y");
    }
    MethodRun result;
    result.times = s.shade_warm(method, on);
    const auto white = on.white.download();
    const SphereView& view = on.view;
    result.errors.resize(3 * view.count);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < view.count; ++i) {
            const std::size_t at = c * view.stride + i;
            const double error = (static_cast<double>(white[at]) - static_cast<double>(exact[at])) / mean;
            result.errors[c * view.count + i] = static_cast<float>(error);
        }
    }
    return result;
}

std::vector<float> Workbench::as_picture(const RenderOptions& method, const std::vector<float>& errors) {
    const SphereView& view = state_->sphere(method.size).view;
    const auto pixel = view.pixel.download();
    std::vector<float> values(view.size * view.size, std::numeric_limits<float>::quiet_NaN());
    for (std::size_t i = 0; i < view.count; ++i) {
        values[pixel[i]] = (errors[i] + errors[view.count + i] + errors[2 * view.count + i]) / 3;
    }
    return values;
}

}  // namespace clerestory
