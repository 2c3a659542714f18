#pragma once

#include <cstddef>
#include <memory>

#include "cl/buffer.hpp"
#include "cl/device.hpp"
#include "sampling/stage3_sample.hpp"
#include "shading/pixels.hpp"

namespace clerestory {

/// Lights from single directions, on the device.
struct LightBuffer {
    LightBuffer() = default;
    LightBuffer(const Device& device, std::size_t count);

    std::size_t count = 0;
    std::size_t stride = 0;  ///< `count` padded to whole registers; the padding is zero
    /// [6 * stride], planes x, y, z of the direction, unit length, then what each adds to a white surface that faces
    /// it: weights of R, G, B, times 2^-exponent of the map
    Buffer<cl_float> planes;
};

/// Lights every pixel with the same lights.
class LightShader {
  public:
    /// every_pair: every light meets every pixel, which is what devices that put work-items side by side do in any
    /// case;
    ///             elsewhere the plain sum that the faster one is held against.
    explicit LightShader(const Device& device, bool every_pair = false);
    LightShader(LightShader&&) noexcept;
    LightShader& operator=(LightShader&&) noexcept;
    ~LightShader();

    /// A sample set as lights: each weighs radiance over density, times `share`.
    ///   scale  2^-exponent of the map
    void weigh(const SampleSet& set, float scale, float share, LightBuffer& lights);

    /// Radiance of a white surface.
    ///   add    whether it is added to what stands in `unit_albedo_radiance``
    ///   unit_albedo_radiance  as SphereView::planes
    void shade(const SphereView& view, const LightBuffer& lights, bool add, Buffer<cl_float>& unit_albedo_radiance);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clerestory
