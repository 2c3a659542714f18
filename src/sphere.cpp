#include "sphere.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"
#include "clock.hpp"
#include "harmonic.hpp"
#include "legendre.hpp"

namespace clerestory {
namespace {

// Samples of a batch: 36 MB of records, which bounds the memory of any count.
constexpr std::size_t BATCH = std::size_t{1} << 20;

constexpr std::size_t PIXELS_WIDE_ON_CPU = 16;
constexpr std::size_t REGISTERS = 4;

/// 1 / (pi N), what each of N samples counts in the radiance of a white surface.
float sample_share(std::size_t count) {
    return static_cast<float>(1 / (std::numbers::pi * static_cast<double>(count)));
}

/// 2^-exponent; an exponent of a distribution lies within -126 .. 126.
float map_scale(const Distribution& distribution) { return std::ldexp(1.0F, -distribution.exponent); }

/// Compile-time choices of a control variate. Throws UsageError.
std::string control_defines(unsigned degree) {
    if (degree > SamplingOptions::MAX_CONTROL_DEGREE) {
        throw UsageError(fmt::format("control degree {}: at most {}", degree, SamplingOptions::MAX_CONTROL_DEGREE));
    }
    if (degree == 0) return "-DCONTROL_DEGREE=0";
    std::string series;
    for (const double c : clamped_cosine_series(degree)) {
        series += fmt::format("{}{:a}f", series.empty() ? "" : ",", static_cast<float>(c));
    }
    return fmt::format("-DCONTROL_DEGREE={} -DCONTROL_SERIES={}", degree, series);
}

/// Exposed radiances at which round(255 x^(1/gamma)) becomes 1, 2, ... 255. None is 0, however steep the curve.
std::vector<float> tone_steps(double gamma) {
    constexpr int STEPS = 255;
    std::vector<float> steps;
    for (int k = 1; k <= STEPS; ++k) {
        const auto step = static_cast<float>(std::pow((k - 0.5) / STEPS, gamma));
        steps.push_back(std::max(step, std::numeric_limits<float>::denorm_min()));
    }
    return steps;
}

}  // namespace

SphereView::SphereView(const Device& device, std::size_t size_of_side) : size(size_of_side) {
    std::vector<cl_uint> pixels;
    std::vector<double> normals;
    const auto s = static_cast<double>(size);
    for (std::size_t py = 0; py < size; ++py) {
        const double y = 1 - 2 * (static_cast<double>(py) + 0.5) / s;
        for (std::size_t px = 0; px < size; ++px) {
            const double x = 2 * (static_cast<double>(px) + 0.5) / s - 1;
            const double beside = x * x + y * y;
            if (beside >= 1) continue;
            pixels.push_back(narrow(py * size + px));
            normals.insert(normals.end(), {x, y, std::sqrt(1 - beside)});
        }
    }
    count = pixels.size();
    stride = (count + PIXELS_PER_ITEM - 1) / PIXELS_PER_ITEM * PIXELS_PER_ITEM;
    pixels.resize(stride, 0);
    std::vector<cl_float> planes(3 * stride, 0.0F);
    std::fill(planes.begin() + static_cast<std::ptrdiff_t>(2 * stride), planes.end(), 1.0F);
    for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t c = 0; c < 3; ++c) planes[c * stride + i] = static_cast<float>(normals[3 * i + c]);
    }
    pixel = Uints(device, "the sphere's pixels", std::span<const cl_uint>(pixels));
    normal = Floats(device, "the sphere's normals", std::span<const cl_float>(planes));
}

Floats SphereView::planes(const Device& device) const { return {device, "the sphere's radiance", 3 * stride}; }

struct SharedShader::State {
    explicit State(const Device& opened) : device(opened) {}

    /// The kernels for one degree of the control variate.
    struct Kernels {
        Kernels(const Device& device, std::size_t pixels_wide, unsigned control_degree)
            : program(device, "stage4_shade.cl",
                      fmt::format("-DPIXELS_WIDE={} -DREGISTERS={} {}", pixels_wide, REGISTERS,
                                  control_defines(control_degree))),
              weigh_lights(device, program, "weigh_lights"),
              shade_shared(device, program, "shade_shared") {}

        Program program;
        Kernel<Floats, Floats, Floats, cl_uint, cl_float, cl_float, Floats> weigh_lights;
        Kernel<Floats, Floats, cl_uint, cl_uint, cl_uint, cl_uint, Floats> shade_shared;
    };

    Kernels& kernels_for(unsigned degree) {
        return kernels.try_emplace(degree, device, pixels_wide, degree).first->second;
    }

    /// Starts `white` with the control variate's harmonics.
    void start_control(Sampler& sampler, const SphereView& view, Floats& white) {
        if (!harmonics) harmonics.emplace(device);
        harmonics->shade_series(sampler.control(*harmonics), sampler.options().rotate_y_deg, view, white);
    }

    const Device& device;
    std::size_t pixels_wide = device.info().is_cpu ? PIXELS_WIDE_ON_CPU : 1;
    std::map<unsigned, Kernels> kernels;
    std::optional<HarmonicShader> harmonics;
    double drawing_seconds = 0;
};

SharedShader::SharedShader(const Device& device) : state_(std::make_unique<State>(device)) {}
SharedShader::SharedShader(SharedShader&&) noexcept = default;
SharedShader& SharedShader::operator=(SharedShader&&) noexcept = default;
SharedShader::~SharedShader() = default;

double SharedShader::drawing_seconds() const noexcept { return state_->drawing_seconds; }

void SharedShader::shade(Sampler& sampler, const Distribution& distribution, const SphereView& view, std::size_t count,
                         Floats& white) {
    State& s = *state_;
    s.drawing_seconds = 0;
    const unsigned degree = sampler.options().control_degree;
    State::Kernels& kernels = s.kernels_for(degree);
    if (degree > 0) s.start_control(sampler, view, white);
    SampleSet set;
    Floats lights;
    for (std::size_t first = 0; first < count; first += BATCH) {
        const std::size_t batch = std::min(BATCH, count - first);
        const Stopwatch drawing;
        if (set.count != batch) {
            set = sampler.allocate(batch);
            lights = Floats(s.device, "the lights", 8 * batch);
        }
        sampler.draw_into(set, first, count);
        kernels.weigh_lights({batch, s.device.work_group(64)}, set.direction, set.pdf, set.radiance, narrow(batch),
                             map_scale(distribution), sample_share(count), lights);
        s.device.finish();
        s.drawing_seconds += drawing.seconds();
        const std::size_t items = view.stride / (s.pixels_wide * REGISTERS);
        kernels.shade_shared({items, s.device.work_group(4)}, view.normal, lights, narrow(batch), narrow(view.stride),
                             narrow(items), first == 0 && degree == 0 ? 0U : 1U, white);
    }
    s.device.finish();
}

struct PerPixelShader::State {
    State(const Device& opened, const DeviceMap& lit, const Distribution& drawn_from, const SamplingOptions& chosen)
        : device(opened), map(lit), distribution(drawn_from), options(chosen) {}

    const Device& device;
    const DeviceMap& map;
    const Distribution& distribution;
    SamplingOptions options;
    Program program{device, "stage4_shade.cl",
                    draw_defines(distribution, options) + " " + control_defines(options.control_degree)};
    Kernel<Uints, Uints, cl_uint, cl_uint, Uints, Uints, cl_uint, cl_uint, Buffer<RowFrame>, Floats, cl_float, cl_float,
           cl_uint, cl_uint, Strata, cl_float, cl_float, cl_uint, cl_uint, Floats, Uints, cl_uint, Floats>
        shade_per_pixel{device, program, "shade_per_pixel"};
    std::optional<HarmonicShader> harmonics;
    std::optional<HarmonicLight> control;

    /// Starts `white` with the control variate's harmonics.
    void start_control(const SphereView& view, Floats& white) {
        if (!control) {
            harmonics.emplace(device);
            control = harmonics->project(map, distribution, {options.control_degree, 0});
        }
        harmonics->shade_series(*control, options.rotate_y_deg, view, white);
    }
};

PerPixelShader::PerPixelShader(const Device& device, const DeviceMap& map, const Distribution& distribution,
                               const SamplingOptions& options)
    : state_(std::make_unique<State>(device, map, distribution, options)) {
    if (distribution.black()) throw InputError("the map is black: there is nothing to draw samples from");
}
PerPixelShader::PerPixelShader(PerPixelShader&&) noexcept = default;
PerPixelShader& PerPixelShader::operator=(PerPixelShader&&) noexcept = default;
PerPixelShader::~PerPixelShader() = default;

void PerPixelShader::reseed(std::uint64_t seed) noexcept { state_->options.seed = seed; }
void PerPixelShader::rotate(double rotate_y_deg) noexcept { state_->options.rotate_y_deg = rotate_y_deg; }

void PerPixelShader::shade(const SphereView& view, std::size_t count, Floats& white) {
    State& s = *state_;
    const Distribution& d = s.distribution;
    if (s.options.control_degree > 0) s.start_control(view, white);
    const Range range{view.stride, s.device.work_group(64)};
    for (std::size_t k = 0; 2 * k < count; ++k) {
        s.shade_per_pixel(range, d.marginal, d.marginal_guide, narrow(d.height), d.row_bits, d.conditional,
                          d.conditional_guide, narrow(d.width), d.column_bits, d.frames, s.map.radiance,
                          static_cast<float>(1.0 / static_cast<double>(d.width)),
                          rotation_turns(s.options.rotate_y_deg), static_cast<cl_uint>(s.options.seed),
                          static_cast<cl_uint>(s.options.seed >> 32), strata(count), map_scale(d), sample_share(count),
                          narrow(k), 2 * k + 1 < count ? 1U : 0U, view.normal, view.pixel, narrow(view.stride), white);
    }
    s.device.finish();
}

struct Display::State {
    explicit State(const Device& opened) : device(opened) {}

    const Device& device;
    Program program{device, "display.cl"};
    Kernel<Floats, Uints, cl_uint, cl_uint, cl_float, cl_float, Floats> compose{device, program, "compose"};
    Kernel<Floats, cl_uint, cl_uint, cl_float, Floats, Uints> tone_map{device, program, "tone_map"};
    Kernel<Uints, cl_uint, cl_uint, cl_uint, Uints> mark_samples{device, program, "mark_samples"};
    Floats rgba;  ///< kept from one picture to the next: fresh pages cost as much as composing

    Uints tone(std::span<const float> pixels, std::size_t channels, double gain, const ToneOptions& options) {
        const std::size_t count = pixels.size() / channels;
        const Floats from = Floats::over(device, "the picture", pixels);  // a large map is not copied
        const std::vector<float> curve = tone_steps(options.gamma);
        const Floats steps(device, "the tone curve", std::span<const float>(curve));
        Uints preview(device, "the preview", count);
        tone_map({count, device.work_group(64)}, from, narrow(channels), narrow(count),
                 static_cast<float>(gain * options.exposure), steps, preview);
        return preview;
    }
};

Display::Display(const Device& device) : state_(std::make_unique<State>(device)) {}
Display::Display(Display&&) noexcept = default;
Display& Display::operator=(Display&&) noexcept = default;
Display::~Display() = default;

std::vector<float> Display::compose(const SphereView& view, const Floats& white, double gain, int exponent) {
    State& s = *state_;
    // Half of the power of two with each factor: 2^exponent times the gain may leave float32 where the result does not.
    const int half = exponent / 2;
    const auto gain_a = static_cast<float>(std::ldexp(gain, half));
    const auto gain_b = std::ldexp(1.0F, exponent - half);
    const std::size_t values = 4 * view.size * view.size;
    if (s.rgba.size() != values) s.rgba = Floats(s.device, "the picture", values);
    s.rgba.fill(0.0F);
    s.compose({view.count, s.device.work_group(64)}, white, view.pixel, narrow(view.count), narrow(view.stride), gain_a,
              gain_b, s.rgba);
    return s.rgba.download();
}

std::vector<cl_uint> Display::preview(std::span<const float> pixels, std::size_t channels, const ToneOptions& tone) {
    return state_->tone(pixels, channels, 1, tone).download();
}

std::vector<cl_uint> Display::marked_preview(const RadianceMap& map, double scale, const ToneOptions& tone,
                                             const Uints& texel) {
    State& s = *state_;
    Uints preview = s.tone({map.rgb.data(), map.rgb.size()}, 3, scale, tone);
    s.mark_samples({texel.size(), s.device.work_group(64)}, texel, narrow(texel.size()), narrow(map.width),
                   narrow(map.height), preview);
    return preview.download();
}

}  // namespace clerestory
