#include "sphere.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"
#include "clock.hpp"
#include "harmonic.hpp"
#include "legendre.hpp"
#include "lights.hpp"

namespace clerestory {
namespace {

// Samples of a batch: 36 MB of records, which bounds the memory of any count.
constexpr std::size_t BATCH = std::size_t{1} << 20;

/// 1 / (pi N), what each of N samples counts in the radiance of a white surface.
float sample_share(std::size_t count) {
    return static_cast<float>(1 / (std::numbers::pi * static_cast<double>(count)));
}

/// 2^-exponent; an exponent of a distribution lies within -126 .. 126.
float map_scale(const Distribution& distribution) { return std::ldexp(1.0F, -distribution.exponent); }

/// Throws UsageError.
void check_control_degree(unsigned degree) {
    if (degree > SamplingOptions::MAX_CONTROL_DEGREE) {
        throw UsageError(fmt::format("control degree {}: at most {}", degree, SamplingOptions::MAX_CONTROL_DEGREE));
    }
}

/// Compile-time choices of a control variate. Throws UsageError.
std::string control_defines(unsigned degree) {
    check_control_degree(degree);
    if (degree == 0) return "-DCONTROL_DEGREE=0";
    std::string series;
    for (const double c : clamped_cosine_series(degree)) {
        series += fmt::format("{}{:a}f", series.empty() ? "" : ",", static_cast<float>(c));
    }
    return fmt::format("-DCONTROL_DEGREE={} -DCONTROL_SERIES={}", degree, series);
}

/// Exposed radiances at which round(255 x^(1/gamma)) becomes 1, 2, ... 255. None is 0, nor so small that a device may
/// count it as 0, however steep the curve.
std::vector<float> tone_steps(double gamma) {
    constexpr int STEPS = 255;
    std::vector<float> steps;
    for (int k = 1; k <= STEPS; ++k) {
        const auto step = static_cast<float>(std::pow((k - 0.5) / STEPS, gamma));
        steps.push_back(std::max(step, std::numeric_limits<float>::min()));
    }
    return steps;
}

/// The squares of a grid along a Hilbert curve, at every step the next neighbour.
/// Source: Hilbert, Ueber die stetige Abbildung einer Linie auf ein Flaechenstueck, 1891.
///   side     of the square at (x, y), a power of two
///   swapped  the curve's square is mirrored in its diagonal
///   turned   it is turned by 180 degrees
///   wanted   whether the curve enters a square: (x, y, side)
template <class Wanted, class Visit>
void walk_hilbert(std::size_t x, std::size_t y, std::size_t side, bool swapped, bool turned, const Wanted& wanted,
                  const Visit& visit) {
    if (!wanted(x, y, side)) return;
    if (side == 1) {
        visit(x, y);
        return;
    }
    const std::size_t half = side / 2;
    constexpr std::array<std::array<bool, 2>, 4> QUADRANTS = {
        {{false, false}, {false, true}, {true, true}, {true, false}}};
    for (std::size_t q = 0; q < QUADRANTS.size(); ++q) {
        const bool u = QUADRANTS[q][swapped ? 1 : 0] != turned;
        const bool v = QUADRANTS[q][swapped ? 0 : 1] != turned;
        const bool at_an_end = q == 0 || q == 3;
        walk_hilbert(x + (u ? half : 0), y + (v ? half : 0), half, swapped != at_an_end, turned != (q == 3), wanted,
                     visit);
    }
}

/// A pixel of the sphere and its normal.
struct SpherePixel {
    std::size_t index;
    std::array<double, 3> normal;
};

/// The pixels of a picture of the given side that show the sphere, along a Hilbert curve.
std::vector<SpherePixel> sphere_pixels(std::size_t size) {
    std::vector<SpherePixel> pixels;
    pixels.reserve(size * size);  // a little more than the disc holds
    const auto s = static_cast<double>(size);
    const auto across = [&](std::size_t p) { return 2 * (static_cast<double>(p) + 0.5) / s - 1; };
    // Squares beside the picture or the disc are passed over whole.
    const auto wanted = [&](std::size_t x, std::size_t y, std::size_t side) {
        if (x >= size || y >= size) return false;
        const double dx = std::clamp(0.0, across(x), across(x + side - 1));
        const double dy = std::clamp(0.0, across(y), across(y + side - 1));
        return dx * dx + dy * dy < 1;
    };
    const auto visit = [&](std::size_t px, std::size_t py) {
        const double x = across(px);
        const double y = 1 - 2 * (static_cast<double>(py) + 0.5) / s;
        pixels.push_back({py * size + px, {x, y, std::sqrt(1 - (x * x + y * y))}});
    };
    walk_hilbert(0, 0, std::bit_ceil(size), false, false, wanted, visit);
    return pixels;
}

/// Axis and sine of the half angle of a cone about normals, see SphereView::cone.
std::array<float, 4> cone_about(std::span<const SpherePixel> pixels) {
    // Directions and normals in float32 are off by 1e-6 together.
    constexpr double MARGIN = 4e-6;
    std::array<double, 3> axis{};
    for (const auto& p : pixels) {
        for (std::size_t c = 0; c < 3; ++c) axis[c] += p.normal[c];
    }
    const double length = std::hypot(axis[0], axis[1], axis[2]);  // every normal has a positive z
    double least = 1;
    for (const auto& p : pixels) {
        least = std::min(least, (p.normal[0] * axis[0] + p.normal[1] * axis[1] + p.normal[2] * axis[2]) / length);
    }
    const double sine = least > 0 ? std::sqrt(1 - least * least) + MARGIN : 2;
    return {static_cast<float>(axis[0] / length), static_cast<float>(axis[1] / length),
            static_cast<float>(axis[2] / length), static_cast<float>(sine)};
}

}  // namespace

SphereView::SphereView(const Device& device, std::size_t size_of_side) : size(size_of_side) {
    const std::vector<SpherePixel> pixels = sphere_pixels(size);
    count = pixels.size();
    const std::size_t groups = (count + GROUP_PIXELS - 1) / GROUP_PIXELS;
    stride = groups * GROUP_PIXELS;
    std::vector<cl_uint> indices(stride, 0);
    std::vector<cl_float> planes(3 * stride, 0.0F);
    std::fill(planes.begin() + static_cast<std::ptrdiff_t>(2 * stride), planes.end(), 1.0F);
    for (std::size_t i = 0; i < count; ++i) {
        indices[i] = narrow(pixels[i].index);
        for (std::size_t c = 0; c < 3; ++c) planes[c * stride + i] = static_cast<float>(pixels[i].normal[c]);
    }
    std::vector<cl_float> cones;
    for (std::size_t first = 0; first < count; first += GROUP_PIXELS) {
        const auto about = cone_about({&pixels[first], std::min(GROUP_PIXELS, count - first)});
        cones.insert(cones.end(), about.begin(), about.end());
    }
    pixel = Uints(device, "the sphere's pixels", std::span<const cl_uint>(indices));
    normal = Floats(device, "the sphere's normals", std::span<const cl_float>(planes));
    cone = Floats(device, "the sphere's cones", std::span<const cl_float>(cones));
}

Floats SphereView::planes(const Device& device) const { return {device, "the sphere's radiance", 3 * stride}; }

struct SharedShader::State {
    explicit State(const Device& opened) : device(opened), shader(opened) {}

    const Device& device;
    LightShader shader;
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
    check_control_degree(degree);
    if (degree > 0 && !s.harmonics) s.harmonics.emplace(s.device);
    SampleSet set;
    Lights lights;
    HarmonicCoefficients drawn;
    for (std::size_t first = 0; first < count; first += BATCH) {
        const std::size_t batch = std::min(BATCH, count - first);
        const Stopwatch drawing;
        if (set.count != batch) {
            set = sampler.allocate(batch);
            lights = Lights(s.device, batch);
        }
        sampler.draw_into(set, first, count);
        s.shader.weigh(set, map_scale(distribution), sample_share(count), lights);
        s.device.finish();
        s.drawing_seconds += drawing.seconds();
        s.shader.shade(view, lights, first > 0, white);
        if (degree > 0) s.harmonics->project(lights, degree, drawn);
    }
    // Every sample counts c_L less, c_L the clamped cosine's series; over the whole set that is the set's own
    // harmonics.
    if (degree > 0) {
        s.harmonics->add_difference(sampler.control(*s.harmonics), sampler.options().rotate_y_deg, drawn, view, white);
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
    Program program{device, "stage4_per_pixel.cl",
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
    const Range range = s.device.thin(view.stride);
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
        tone_map(device.thin(count), from, narrow(channels), narrow(count), static_cast<float>(gain * options.exposure),
                 steps, preview);
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
    s.compose(s.device.thin(view.count), white, view.pixel, narrow(view.count), narrow(view.stride), gain_a, gain_b,
              s.rgba);
    return s.rgba.download();
}

std::vector<cl_uint> Display::preview(std::span<const float> pixels, std::size_t channels, const ToneOptions& tone) {
    return state_->tone(pixels, channels, 1, tone).download();
}

std::vector<cl_uint> Display::marked_preview(const RadianceMap& map, double scale, const ToneOptions& tone,
                                             const Uints& texel) {
    State& s = *state_;
    Uints preview = s.tone({map.rgb.data(), map.rgb.size()}, 3, scale, tone);
    s.mark_samples(s.device.thin(texel.size()), texel, narrow(texel.size()), narrow(map.width), narrow(map.height),
                   preview);
    return preview.download();
}

}  // namespace clerestory
