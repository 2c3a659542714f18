#include "shading/stage4_per_pixel.hpp"

#include <fmt/format.h>

#include <string>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"
#include "error.hpp"
#include "sampling/stage3_sample.hpp"
#include "shading/legendre.hpp"

namespace clerestory {
namespace {

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

}  // namespace

struct PerPixelShader::State {
    State(const Device& opened, const DeviceMap& lit, const Distribution& drawn_from, const SamplingOptions& chosen)
        : device(opened), map(lit), distribution(drawn_from), options(chosen) {}

    const Device& device;
    const DeviceMap& map;
    const Distribution& distribution;
    SamplingOptions options;
    Program program{device, "stage4_per_pixel.cl",
                    draw_defines(distribution, options) + " " + control_defines(options.control_degree)};
    Kernel<Uints, Uints, Uints, Uints, Buffer<RowFrame>, Floats, DrawSettings, cl_float, cl_float, cl_uint, cl_uint,
           Floats, Uints, cl_uint, Floats>
        shade_per_pixel{device, program, "shade_per_pixel"};
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

void PerPixelShader::shade(const SphereView& view, std::size_t count, Floats& unit_albedo_radiance,
                           const ControlVariate& control) {
    State& s = *state_;
    const Distribution& d = s.distribution;
    control.check(s.options);
    if (control) control.shader->shade_series(*control.map, s.options.rotate_y_deg, view, unit_albedo_radiance);
    // Launches that may wait in the queue: each takes memory there.
    constexpr std::size_t MOST_QUEUED = 256;
    const Range range = s.device.thin(view.stride);
    const DrawSettings settings = draw_settings(d, s.options, count);
    for (std::size_t k = 0; 2 * k < count; ++k) {
        s.shade_per_pixel(range, d.marginal, d.marginal_guide, d.conditional, d.conditional_guide, d.frames,
                          s.map.radiance, settings, map_scale(d), sample_share(count), narrow(k),
                          2 * k + 1 < count ? 1U : 0U, view.normal, view.pixel, narrow(view.stride),
                          unit_albedo_radiance);
        if (k % MOST_QUEUED == MOST_QUEUED - 1) s.device.finish();
    }
    s.device.finish();
}

}  // namespace clerestory
