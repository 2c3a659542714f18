#include "measure/error_meter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "base/clock.hpp"
#include "base/statistics.hpp"
#include "error.hpp"
#include "render/method.hpp"
#include "shading/pixels.hpp"

namespace clerestory {
namespace {

// Enough to go through every kernel that a sampling method has.
constexpr std::size_t WARM_UP_SAMPLES = 8;
// The exact picture's kernels are compiled by one this small.
constexpr std::size_t WARM_UP_SIZE = 16;

MethodTimes times_of(const StageSeconds& seconds) {
    MethodTimes times;
    for (const auto& [stage, value] : seconds) {
        if (stage == "project") times.project = value;
        if (stage == "draw") times.draw = value;
        if (stage == "shade") times.shade = value;
    }
    return times;
}

}  // namespace

struct ErrorMeter::State {
    /// A sphere of one size, and what is known to be its picture at each rotation.
    struct Sphere {
        Sphere(const Device& device, std::size_t size)
            : view(device, size), unit_albedo_radiance(view.planes(device)) {}
        SphereView view;
        Buffer<cl_float> unit_albedo_radiance;
        std::map<double, ExactPicture> exact;
    };
    /// What the kernels of a method depend on.
    using WarmKey = std::tuple<Estimator, Sequence, unsigned, std::size_t>;

    State(Renderer& by, const Scene& lit) : renderer(by), scene(lit) {}

    Renderer& renderer;
    const Scene& scene;
    std::map<std::size_t, Sphere> spheres;
    std::map<unsigned, double> control_seconds;  ///< of the control variate's projection, by degree
    std::set<WarmKey> warm;

    Sphere& sphere(std::size_t size) { return spheres.try_emplace(size, renderer.device(), size).first->second; }

    static WarmKey warm_key(const RenderOptions& m) {
        if (!draws_samples(m.estimator)) return {m.estimator, Sequence::random, 0, m.size};
        return {m.estimator, m.sampling.sequence, m.sampling.control_degree, m.size};
    }

    /// The renderer keeps projections from one picture to the next; a single picture has to pay for its own.
    double control_projection(unsigned degree) {
        if (degree == 0) return 0;
        constexpr int RUNS = 5;
        const auto [entry, is_new] = control_seconds.try_emplace(degree, std::numeric_limits<double>::infinity());
        for (int k = 0; is_new && k <= RUNS; ++k) {
            renderer.forget_projection({degree, 0});
            const Stopwatch watch;
            (void)renderer.projection(scene, {degree, 0});
            if (k > 0) entry->second = std::min(entry->second, watch.seconds());  // the first one warms up
        }
        return entry->second;
    }

    MethodTimes shade(const RenderOptions& m, Sphere& on, const ProgressFunction& progress = {}) {
        if (m.estimator == Estimator::harmonic) renderer.forget_projection(m.harmonic);
        MethodTimes times = times_of(renderer.shade(scene, m, on.view, on.unit_albedo_radiance, progress));
        if (draws_samples(m.estimator)) times.project = control_projection(m.sampling.control_degree);
        return times;
    }

    MethodTimes shade_warm(const RenderOptions& m, Sphere& on) {
        if (warm.insert(warm_key(m)).second) {
            RenderOptions first = m;
            first.samples = std::min(m.samples, WARM_UP_SAMPLES);
            (void)shade(first, on);
        }
        return shade(m, on);
    }

    /// The exact picture, made where `made` is still empty.
    void make_exact(RenderOptions m, Sphere& on, ExactPicture& made, const ProgressFunction& progress) {
        m.estimator = Estimator::exact;
        if (warm.insert({Estimator::exact, Sequence::random, 0, WARM_UP_SIZE}).second) {
            RenderOptions first = m;
            first.size = WARM_UP_SIZE;
            (void)shade(first, sphere(WARM_UP_SIZE));
        }
        made.times = shade(m, on, progress);
        warm.insert(warm_key(m));
        made.planes = on.unit_albedo_radiance.download();
        made.light = std::exchange(on.unit_albedo_radiance, on.view.planes(renderer.device()));
        for (std::size_t c = 0; c < 3; ++c) {
            const cl_float* plane = made.planes.data() + c * on.view.stride;
            for (std::size_t i = 0; i < on.view.count; ++i) made.mean += static_cast<double>(plane[i]);
        }
        made.mean /= 3 * static_cast<double>(on.view.count);
    }

    /// Errors of a picture whose value in plane c at pixel i of the view is value(c, i).
    template <class Value>
    static ErrorPlanes errors(const SphereView& view, const ExactPicture& exact, const Value& value) {
        ErrorPlanes errors(3 * view.count);
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t i = 0; i < view.count; ++i) {
                const auto truth = static_cast<double>(exact.planes[c * view.stride + i]);
                errors[c * view.count + i] = static_cast<float>((value(c, i) - truth) / exact.mean);
            }
        }
        return errors;
    }
};

ErrorMeter::ErrorMeter(Renderer& renderer, const Scene& scene) : state_(std::make_unique<State>(renderer, scene)) {}
ErrorMeter::ErrorMeter(ErrorMeter&&) noexcept = default;
ErrorMeter& ErrorMeter::operator=(ErrorMeter&&) noexcept = default;
ErrorMeter::~ErrorMeter() = default;

const SphereView& ErrorMeter::view(std::size_t size) { return state_->sphere(size).view; }

const ExactPicture& ErrorMeter::exact(const RenderOptions& method, const ProgressFunction& progress) {
    State::Sphere& on = state_->sphere(method.size);
    const auto [entry, is_new] = on.exact.try_emplace(method.sampling.rotate_y_deg);
    if (is_new) state_->make_exact(method, on, entry->second, progress);
    return entry->second;
}

const ExactPicture& ErrorMeter::lit_exact(const RenderOptions& method, const ProgressFunction& progress) {
    const ExactPicture& picture = exact(method, progress);
    if (!(picture.mean > 0)) {
        throw InputError(
            "no light of the map reaches the side of the sphere that is seen, so that there is no relative error: turn "
            "the map with --rotate-y");
    }
    return picture;
}

MethodTimes ErrorMeter::time(const RenderOptions& method) {
    return state_->shade_warm(method, state_->sphere(method.size));
}

MethodRun ErrorMeter::run(const RenderOptions& method) {
    const ExactPicture& truth = lit_exact(method);
    State::Sphere& on = state_->sphere(method.size);
    const MethodTimes times = state_->shade_warm(method, on);
    const auto unit_albedo_radiance = on.unit_albedo_radiance.download();
    const auto value = [&](std::size_t c, std::size_t i) {
        return static_cast<double>(unit_albedo_radiance[c * on.view.stride + i]);
    };
    return {times, State::errors(on.view, truth, value)};
}

ErrorPlanes ErrorMeter::errors_of_picture(const RenderOptions& method, const std::vector<float>& rgba, double gain) {
    const ExactPicture& truth = lit_exact(method);
    const SphereView& pixels = view(method.size);
    const auto pixel = pixels.pixel.download();
    const int exponent = state_->scene.distribution().exponent;
    return State::errors(pixels, truth, [&](std::size_t c, std::size_t i) {
        return std::ldexp(static_cast<double>(rgba[4 * std::size_t{pixel[i]} + c]) / gain, -exponent);
    });
}

std::vector<double> ErrorMeter::exact_values(const RenderOptions& method) {
    const ExactPicture& picture = exact(method);
    const SphereView& pixels = view(method.size);
    std::vector<double> values;
    values.reserve(3 * pixels.count);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < pixels.count; ++i) {
            const auto value = static_cast<double>(picture.planes[c * pixels.stride + i]);
            values.push_back(std::ldexp(value, state_->scene.distribution().exponent));
        }
    }
    return values;
}

double ErrorMeter::bright_exposure(const RenderOptions& method, double gain, double gamma) {
    constexpr double BRIGHT_SHARE = 0.995;
    constexpr double BRIGHT_LEVEL = 0.95;
    (void)lit_exact(method);
    const double bright = gain * quantile(exact_values(method), BRIGHT_SHARE);
    return std::stod(fmt::format("{:.3g}", std::pow(BRIGHT_LEVEL, gamma) / bright));
}

}  // namespace clerestory
