#include "reproduce/laboratory.hpp"
#include "reproduce/statistics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>

#include "clock.hpp"
#include "error.hpp"
#include "exact.hpp"
#include "reproduce/statistics.hpp"

namespace clerestory {
namespace {

// Squares larger than this hide what the sphere itself looks like at the picture's usual size.
constexpr std::size_t LARGEST_BLOCK = 32;
// A square of an eighth of the picture has room inside the disc wherever squares start.
constexpr std::size_t BLOCKS_ACROSS = 8;

std::vector<std::size_t> sides_for(std::size_t size) {
    std::vector<std::size_t> sides = {1};
    while (2 * sides.back() <= std::min(LARGEST_BLOCK, size / BLOCKS_ACROSS)) sides.push_back(2 * sides.back());
    return sides;
}

/// Means over squares of 2 x 2.
///   values [width * width], width even
std::vector<double> halved(const std::vector<double>& values, std::size_t width) {
    const std::size_t half = width / 2;
    std::vector<double> means(half * half);
    for (std::size_t i = 0; i < half; ++i) {
        for (std::size_t j = 0; j < half; ++j) {
            const double* at = values.data() + 2 * i * width + 2 * j;
            means[i * half + j] = (at[0] + at[1] + at[width] + at[width + 1]) / 4;
        }
    }
    return means;
}

/// Sums over seeds, from which mean and spread come.
struct Sums {
    explicit Sums(std::size_t count) : first(count), second(count) {}
    void add(const ErrorPlanes& errors) {
        for (std::size_t i = 0; i < errors.size(); ++i) {
            const auto e = static_cast<double>(errors[i]);
            first[i] += e;
            second[i] += e * e;
        }
    }
    std::vector<double> first, second;
};

}  // namespace

struct Laboratory::State {
    State(const Device& opened, const Scene& lit, std::size_t size, double rotation)
        : device(opened), scene(lit), view(opened, size), rotate_y_deg(rotation), sides(sides_for(size)) {}

    const Device& device;
    const Scene& scene;
    SphereView view;
    double rotate_y_deg;
    std::vector<std::size_t> sides;
    Buffer<cl_float> exact_white = view.planes(device);
    Buffer<cl_float> white = view.planes(device);
    std::vector<cl_uint> pixel = view.pixel.download();
    std::vector<cl_float> exact;  ///< [3 * stride]
    double mean = 0;              ///< of `exact`, in the map's scale 2^-exponent
    double exact_seconds = 0;
    std::vector<std::size_t> blocked;  ///< pixels in whole squares of the largest side, as places in the planes
    std::optional<SharedShader> shared;
    std::map<unsigned, Sampler> samplers;  ///< by control degree
    std::map<unsigned, PerPixelShader> per_pixel;

    SamplingOptions sampling(unsigned control_degree) const {
        SamplingOptions options;
        options.sequence = Sequence::random;
        options.rotate_y_deg = rotate_y_deg;
        options.control_degree = control_degree;
        return options;
    }

    void measure_truth(const ProgressFunction& progress) {
        const Stopwatch watch;
        ExactIntegrator integrator(device);
        integrator.shade(scene.device_map(), scene.distribution(), rotate_y_deg, view, exact_white, progress);
        exact = exact_white.download();
        exact_seconds = watch.seconds();
        for (std::size_t c = 0; c < 3; ++c) {
            for (std::size_t i = 0; i < view.count; ++i) mean += static_cast<double>(exact[c * view.stride + i]);
        }
        mean /= 3 * static_cast<double>(view.count);
        if (!(mean > 0)) {
            throw InputError(
                "no light of the map reaches the side of the sphere that is seen: turn the map with --rotate-y");
        }
    }

    /// Pixels of squares of the largest side that lie in the disc wholly: the same for every side.
    void find_blocked() {
        const std::size_t side = sides.back();
        const std::size_t across = view.size / side;
        std::vector<std::size_t> filled(across * across, 0);
        const auto block_of = [&](std::size_t i) -> std::optional<std::size_t> {
            const std::size_t row = pixel[i] / view.size / side;
            const std::size_t column = pixel[i] % view.size / side;
            if (row >= across || column >= across) return {};
            return row * across + column;
        };
        for (std::size_t i = 0; i < view.count; ++i) {
            if (const auto block = block_of(i)) ++filled[*block];
        }
        for (std::size_t i = 0; i < view.count; ++i) {
            const auto block = block_of(i);
            if (block && filled[*block] == side * side) blocked.push_back(i);
        }
    }

    /// One plane's errors at the pixels of whole squares, 0 elsewhere.
    ///   returns [across * across * side^2], rows of across * side
    std::vector<double> blocked_plane(const ErrorPlanes& errors, std::size_t plane) const {
        const std::size_t width = view.size / sides.back() * sides.back();
        std::vector<double> values(width * width, 0);
        for (const std::size_t i : blocked) {
            values[pixel[i] / view.size * width + pixel[i] % view.size] =
                static_cast<double>(errors[plane * view.count + i]);
        }
        return values;
    }

    /// Mean over channels and pixels of the product of errors side by side, over that of squares.
    double neighbour_correlation(const ErrorPlanes& errors) const {
        double products = 0;
        double squares = 0;
        for (std::size_t i = 0; i + 1 < view.count; ++i) {
            if (pixel[i + 1] != pixel[i] + 1) continue;
            for (std::size_t c = 0; c < 3; ++c) {
                const auto left = static_cast<double>(errors[c * view.count + i]);
                const auto right = static_cast<double>(errors[c * view.count + i + 1]);
                products += left * right;
                squares += (left * left + right * right) / 2;
            }
        }
        return squares > 0 ? products / squares : 0;
    }

    void shade(const StudySubject& subject, std::uint64_t seed) {
        const SamplingOptions options = sampling(subject.control_degree);
        if (subject.estimator == Estimator::shared) {
            if (!shared) shared.emplace(device);
            auto [at, made] =
                samplers.try_emplace(subject.control_degree, device, scene.device_map(), scene.distribution(), options);
            at->second.reseed(seed);
            shared->shade(at->second, scene.distribution(), view, subject.samples, white);
        } else {
            auto [at, made] = per_pixel.try_emplace(subject.control_degree, device, scene.device_map(),
                                                    scene.distribution(), options);
            at->second.reseed(seed);
            at->second.shade(view, subject.samples, white);
        }
    }
};

Laboratory::Laboratory(const Device& device, const Scene& scene, std::size_t size, double rotate_y_deg,
                       const ProgressFunction& progress)
    : state_(std::make_unique<State>(device, scene, size, rotate_y_deg)) {
    state_->measure_truth(progress);
    state_->find_blocked();
}
Laboratory::Laboratory(Laboratory&&) noexcept = default;
Laboratory& Laboratory::operator=(Laboratory&&) noexcept = default;
Laboratory::~Laboratory() = default;

std::size_t Laboratory::size() const noexcept { return state_->view.size; }
std::size_t Laboratory::pixels() const noexcept { return state_->view.count; }
double Laboratory::exact_seconds() const noexcept { return state_->exact_seconds; }
const std::vector<std::size_t>& Laboratory::block_sides() const noexcept { return state_->sides; }
double Laboratory::exact_mean() const noexcept {
    return std::ldexp(state_->mean, state_->scene.distribution().exponent);
}

std::vector<float> Laboratory::exact_picture(Display& display, double gain) const {
    return display.compose(state_->view, state_->exact_white, gain, state_->scene.distribution().exponent);
}

std::vector<double> Laboratory::exact_values() const {
    const State& s = *state_;
    std::vector<double> values;
    values.reserve(3 * s.view.count);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < s.view.count; ++i) {
            const auto value = static_cast<double>(s.exact[c * s.view.stride + i]);
            values.push_back(std::ldexp(value, s.scene.distribution().exponent));
        }
    }
    return values;
}

double Laboratory::bright_exposure(double gain, double gamma) const {
    constexpr double BRIGHT_SHARE = 0.995;
    constexpr double BRIGHT_LEVEL = 0.95;
    const double bright = gain * quantile(exact_values(), BRIGHT_SHARE);
    return std::stod(fmt::format("{:.3g}", std::pow(BRIGHT_LEVEL, gamma) / bright));
}

std::pair<ErrorPlanes, double> Laboratory::error_of(const StudySubject& subject, std::uint64_t seed) {
    State& s = *state_;
    const Stopwatch watch;
    s.shade(subject, seed);
    const double seconds = watch.seconds();
    const auto lit = s.white.download();
    ErrorPlanes errors(3 * s.view.count);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < s.view.count; ++i) {
            const std::size_t at = c * s.view.stride + i;
            const double difference = static_cast<double>(lit[at]) - static_cast<double>(s.exact[at]);
            errors[c * s.view.count + i] = static_cast<float>(difference / s.mean);
        }
    }
    return {std::move(errors), seconds};
}

ErrorPlanes Laboratory::errors_of_picture(const std::vector<float>& rgba, double gain) const {
    const State& s = *state_;
    const int exponent = s.scene.distribution().exponent;
    ErrorPlanes errors(3 * s.view.count);
    for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < s.view.count; ++i) {
            const double shown =
                std::ldexp(static_cast<double>(rgba[4 * std::size_t{s.pixel[i]} + c]) / gain, -exponent);
            const auto exact = static_cast<double>(s.exact[c * s.view.stride + i]);
            errors[c * s.view.count + i] = static_cast<float>((shown - exact) / s.mean);
        }
    }
    return errors;
}

std::vector<double> Laboratory::block_rms(const ErrorPlanes& errors) const {
    const State& s = *state_;
    std::vector<double> squares(s.sides.size(), 0.0);
    for (std::size_t c = 0; c < 3; ++c) {
        std::vector<double> means = s.blocked_plane(errors, c);
        std::size_t width = s.view.size / s.sides.back() * s.sides.back();
        for (std::size_t level = 0; level < s.sides.size(); ++level) {
            if (level > 0) {
                means = halved(means, width);
                width /= 2;
            }
            const auto area = static_cast<double>(s.sides[level] * s.sides[level]);
            for (const double mean : means) squares[level] += area * mean * mean;
        }
    }
    for (double& square : squares) square = std::sqrt(square / (3 * static_cast<double>(s.blocked.size())));
    return squares;
}

ErrorParts Laboratory::parts_of(const ErrorPlanes& errors) const {
    ErrorParts parts;
    parts.rel_rmse = root_mean_square(errors);
    for (const float error : errors) parts.rel_bias += static_cast<double>(error);
    parts.rel_bias /= static_cast<double>(errors.size());
    parts.neighbour_correlation = state_->neighbour_correlation(errors);
    parts.block_rms = block_rms(errors);
    return parts;
}

SeedStudy Laboratory::study(const StudySubject& subject, std::uint64_t first, std::size_t count,
                            const ProgressFunction& progress) {
    SeedStudy study;
    study.estimator = subject.estimator;
    study.control_degree = subject.control_degree;
    study.samples = subject.samples;
    study.block_rms.assign(state_->sides.size(), 0.0);
    Sums sums(3 * state_->view.count);
    const auto n = static_cast<double>(count);
    for (std::size_t k = 0; k < count; ++k) {
        const auto [errors, seconds] = error_of(subject, first + k);
        const ErrorParts parts = parts_of(errors);
        study.rel_rmse.push_back(parts.rel_rmse);
        study.rel_bias.push_back(parts.rel_bias);
        study.seconds += seconds / n;
        for (std::size_t b = 0; b < parts.block_rms.size(); ++b) {
            study.block_rms[b] += parts.block_rms[b] * parts.block_rms[b] / n;
        }
        sums.add(errors);
        if (progress) progress(static_cast<double>(k + 1), n);
    }
    for (double& block : study.block_rms) block = std::sqrt(block);
    study.mean.resize(sums.first.size());
    study.spread.resize(sums.first.size());
    for (std::size_t i = 0; i < sums.first.size(); ++i) {
        const double mean = sums.first[i] / n;
        study.mean[i] = static_cast<float>(mean);
        study.spread[i] = static_cast<float>(std::sqrt(std::max(sums.second[i] - n * mean * mean, 0.0) / (n - 1)));
    }
    study.mean_rms = root_mean_square(study.mean);
    study.spread_rms = root_mean_square(study.spread);
    return study;
}

std::vector<float> Laboratory::as_picture(const ErrorPlanes& planes) const {
    const State& s = *state_;
    std::vector<float> picture(s.view.size * s.view.size, std::numeric_limits<float>::quiet_NaN());
    for (std::size_t i = 0; i < s.view.count; ++i) {
        picture[s.pixel[i]] = (planes[i] + planes[s.view.count + i] + planes[2 * s.view.count + i]) / 3;
    }
    return picture;
}

}  // namespace clerestory
