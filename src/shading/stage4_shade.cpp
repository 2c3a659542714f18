#include "shading/stage4_shade.hpp"

#include <fmt/format.h>

#include <optional>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "sampling/stage3_sample.hpp"

namespace clerestory {
namespace {

constexpr std::size_t REGISTERS = 4;
constexpr std::size_t PLANES = 6;

std::string defines(std::size_t pixels_wide) {
    return fmt::format("-DPIXELS_WIDE={} -DREGISTERS={} -DGROUP_PIXELS={}", pixels_wide, REGISTERS,
                       SphereView::GROUP_PIXELS);
}

}  // namespace

LightBuffer::LightBuffer(const Device& device, std::size_t lights)
    : count(lights),
      stride((lights + WIDEST_SIMD - 1) / WIDEST_SIMD * WIDEST_SIMD),
      planes(device, "the lights", PLANES * stride) {}

struct LightShader::State {
    explicit State(const Device& opened) : device(opened) {}

    const Device& device;
    Program program{device, "stage4_shade.cl", defines(device.traits().simd_width)};
    Kernel<Floats, Floats, Floats, cl_uint, cl_float, cl_float, cl_uint, Floats> weigh_lights{device, program,
                                                                                              "weigh_lights"};
    using ByGroup = Kernel<Floats, Floats, Floats, cl_uint, cl_uint, cl_uint, cl_uint, cl_uint, Floats>;
    using ByPixel = Kernel<Floats, Floats, cl_uint, cl_uint, cl_uint, cl_uint, cl_uint, Floats>;
    std::optional<ByGroup> shade_groups;
    std::optional<ByPixel> shade_shared;
};

LightShader::LightShader(const Device& device, bool every_pair) : state_(std::make_unique<State>(device)) {
    State& s = *state_;
    if (device.traits().fat_items && !every_pair) {
        s.shade_groups.emplace(device, s.program, "shade_groups");
    } else {
        s.shade_shared.emplace(device, s.program, "shade_shared");
    }
}
LightShader::LightShader(LightShader&&) noexcept = default;
LightShader& LightShader::operator=(LightShader&&) noexcept = default;
LightShader::~LightShader() = default;

void LightShader::weigh(const SampleSet& set, float scale, float share, LightBuffer& lights) {
    State& s = *state_;
    s.weigh_lights(s.device.thin(lights.stride), set.direction, set.pdf, set.radiance, narrow(set.count), scale, share,
                   narrow(lights.stride), lights.planes);
}

void LightShader::shade(const SphereView& view, const LightBuffer& lights, bool add, Floats& unit_albedo_radiance) {
    State& s = *state_;
    const cl_uint adds = add ? 1U : 0U;
    if (s.shade_groups) {
        const std::size_t groups = view.stride / SphereView::GROUP_PIXELS;
        (*s.shade_groups)(s.device.fat(groups), view.normal, view.cone, lights.planes, narrow(lights.count),
                          narrow(lights.stride), narrow(view.stride), narrow(groups), adds, unit_albedo_radiance);
    } else {
        const std::size_t items = view.stride / (s.device.traits().simd_width * REGISTERS);
        (*s.shade_shared)(s.device.some(items), view.normal, lights.planes, narrow(lights.count), narrow(lights.stride),
                          narrow(view.stride), narrow(items), adds, unit_albedo_radiance);
    }
}

}  // namespace clerestory
