#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "cl/buffer.hpp"
#include "cl/device.hpp"
#include "shading/pixels.hpp"
#include "tables/stage2_cdf.hpp"

namespace clerestory {

/// The ground truth: radiance of a white surface, (1 / pi) times the integral of L max(0, n . w), with the map's
/// radiance constant over each texel's area. No quadrature: the integral over each texel's part above the horizon is a
/// line integral along its edges, and edges are summed by tables (kernels/exact.cl), so that a pixel costs
/// 2 (H + 1) + W look-ups in place of H W texels.
/// Error: rounding to float32; relative RMSE below 2e-7 on every map of tests/exact_test.cpp.
/// Memory on the device: bounded tables (TABLE_BYTES for each of two), and 60 bytes a pixel.
class ExactIntegrator {
  public:
    /// Throws DeviceError where the device has no double precision.
    explicit ExactIntegrator(const Device& device);
    ExactIntegrator(ExactIntegrator&&) noexcept;
    ExactIntegrator& operator=(ExactIntegrator&&) noexcept;
    ~ExactIntegrator();

    /// Returns when the device is done. A black map gives zeros.
    ///   distribution  of the same map; only its scale is used
    ///   unit_albedo_radiance         as SphereView::planes
    ///   progress      called now and then with the operations done and their total (see estimated_operations)
    void shade(const DeviceMap& map, const Distribution& distribution, double rotate_y_deg, const SphereView& view,
               Buffer<cl_float>& unit_albedo_radiance,
               const std::function<void(double done, double total)>& progress = {});

    /// Look-ups of all pixels: what the time is proportional to, but for small pictures of large maps.
    static double estimated_operations(std::size_t pixels, std::size_t width, std::size_t height);

    /// Largest table on the device, unless one latitude or meridian of the map takes more by itself.
    static constexpr std::size_t TABLE_BYTES = std::size_t{64} << 20;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clerestory
