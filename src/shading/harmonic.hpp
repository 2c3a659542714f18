#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "cl/buffer.hpp"
#include "cl/device.hpp"
#include "options.hpp"
#include "shading/pixels.hpp"
#include "tables/stage2_cdf.hpp"

namespace clerestory {

struct LightBuffer;

/// A small piece of the sphere that shines on its own.
struct AreaTexel {
    std::array<double, 3> vector;   ///< integral of w over it, in the map's own frame
    std::array<float, 3> radiance;  ///< times 2^-exponent
};

/// [triangle_size(degree)], for each (l, m): coefficients of R, G, B with cos(m phi), then with sin(m phi), of real
/// orthonormal harmonics, times 2^-exponent of the map. Odd degrees above 1 are 0: they do not light a surface.
using HarmonicCoefficients = std::vector<std::array<double, 6>>;

/// A map as direct lights and a harmonic series: shades any number of spheres, at any rotation.
struct ProjectedMap {
    std::size_t degree = 0;
    HarmonicCoefficients coefficients;  ///< in the map's own frame
    std::vector<AreaTexel> lights;
    std::size_t light_texels = 0;  ///< texels that the lights were taken from
    int exponent = 0;              ///< of the map
    /// What the cut leaves out, as relative RMSE over all normals and channels. The bound holds for certain (Parseval:
    /// all light that the series does not hold lies in the next even degree); the estimate continues the spectrum of
    /// the last degrees and was within a factor of three on photographed maps. Both 0 on a black map.
    double truncation_bound = 0;
    double truncation_estimate = 0;
};

/// Lights the sphere by harmonics and direct lights.
class HarmonicShader {
  public:
    explicit HarmonicShader(const Device& device);
    HarmonicShader(HarmonicShader&&) noexcept;
    HarmonicShader& operator=(HarmonicShader&&) noexcept;
    ~HarmonicShader();

    /// Throws UsageError where the options are out of range.
    ProjectedMap project(const DeviceMap& map, const Distribution& distribution, const HarmonicOptions& options = {});

    /// The estimator. The cut can leave a series slightly below 0 where little light falls: the last step raises such
    /// pixels to 0.
    ///   unit_albedo_radiance  as SphereView::planes
    void shade(const ProjectedMap& light, double rotate_y_deg, const SphereView& view,
               Buffer<cl_float>& unit_albedo_radiance);

    /// The series alone, without direct lights and as it is, below 0 too: what a control variate adds back.
    void shade_series(const ProjectedMap& light, double rotate_y_deg, const SphereView& view,
                      Buffer<cl_float>& unit_albedo_radiance);

    /// Adds the coefficients of lights to `coefficients`, in the frame of their directions; empty: starts them.
    void project(const LightBuffer& lights, std::size_t degree, HarmonicCoefficients& coefficients);

    /// Adds to `unit_albedo_radiance`` the series of `light` less that of `taken`, which is of the same degree and in
    /// the picture's frame.
    void add_difference(const ProjectedMap& light, double rotate_y_deg, const HarmonicCoefficients& taken,
                        const SphereView& view, Buffer<cl_float>& unit_albedo_radiance);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// What a sampling estimator adds back of a control variate: the map's series, and who evaluates it. None by default.
struct ControlVariate {
    HarmonicShader* shader = nullptr;
    const ProjectedMap* map = nullptr;

    explicit operator bool() const noexcept { return shader != nullptr; }
    /// Throws UsageError unless the degree is within the limit and this is the control variate of these options.
    void check(const SamplingOptions& options) const;
};

/// Throws UsageError where a control variate may not have this degree.
void check_control_degree(unsigned degree);

}  // namespace clerestory
