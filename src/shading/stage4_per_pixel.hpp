#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "cl/buffer.hpp"
#include "cl/device.hpp"
#include "options.hpp"
#include "shading/harmonic.hpp"
#include "shading/pixels.hpp"
#include "tables/stage2_cdf.hpp"

namespace clerestory {

/// Lights every pixel with a fresh set of samples.
class PerPixelShader {
  public:
    /// The map and the distribution must outlive it. Throws InputError where the map is black.
    PerPixelShader(const Device& device, const DeviceMap& map, const Distribution& distribution,
                   const SamplingOptions& options);
    PerPixelShader(PerPixelShader&&) noexcept;
    PerPixelShader& operator=(PerPixelShader&&) noexcept;
    ~PerPixelShader();

    ///   control  of the options' control degree; none: the plain estimator
    ///   unit_albedo_radiance    as SphereView::planes
    void shade(const SphereView& view, std::size_t count, Buffer<cl_float>& unit_albedo_radiance,
               const ControlVariate& control = {});
    /// Draws other sets from now on, as a new shader of this seed would.
    void reseed(std::uint64_t seed) noexcept;
    /// Turns the map from now on, as a new shader of this rotation would.
    void rotate(double rotate_y_deg) noexcept;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clerestory
