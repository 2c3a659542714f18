#include "shading/display.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "cl/kernel.hpp"
#include "cl/program.hpp"

namespace clerestory {
namespace {

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

}  // namespace

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

std::vector<float> Display::compose(const SphereView& view, const Floats& unit_albedo_radiance, double gain,
                                    int exponent) {
    State& s = *state_;
    // Half of the power of two with each factor: 2^exponent times the gain may leave float32 where the result does not.
    const int half = exponent / 2;
    const auto gain_a = static_cast<float>(std::ldexp(gain, half));
    const auto gain_b = std::ldexp(1.0F, exponent - half);
    const std::size_t values = 4 * view.size * view.size;
    if (s.rgba.size() != values) s.rgba = Floats(s.device, "the picture", values);
    s.rgba.fill(0.0F);
    s.compose(s.device.thin(view.count), unit_albedo_radiance, view.pixel, narrow(view.count), narrow(view.stride),
              gain_a, gain_b, s.rgba);
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
