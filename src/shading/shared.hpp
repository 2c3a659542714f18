#pragma once

#include <cstddef>

#include "cl/buffer.hpp"
#include "cl/device.hpp"
#include "sampling/stage3_sample.hpp"
#include "shading/harmonic.hpp"
#include "shading/pixels.hpp"
#include "shading/stage4_shade.hpp"
#include "tables/stage2_cdf.hpp"

namespace clerestory {

/// Lights every pixel with one shared set of samples.
class SharedShader {
  public:
    explicit SharedShader(const Device& device) : device_(device), shader_(device) {}

    /// Draws `count` samples, in batches that bound the memory, and shades with them.
    ///   control  of the sampler's control degree; none: the plain estimator
    ///   unit_albedo_radiance    as SphereView::planes
    void shade(Sampler& sampler, const Distribution& distribution, const SphereView& view, std::size_t count,
               Buffer<cl_float>& unit_albedo_radiance, const ControlVariate& control = {});

    /// Seconds of the last shade() spent drawing; the rest of it is shading.
    [[nodiscard]] double drawing_seconds() const noexcept { return drawing_seconds_; }

  private:
    const Device& device_;
    LightShader shader_;
    double drawing_seconds_ = 0;
};

}  // namespace clerestory
