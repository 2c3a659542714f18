#pragma once

#include <array>
#include <vector>

#include "image.hpp"
#include "shading/harmonic.hpp"
#include "shading/pixels.hpp"
#include "test_device.hpp"

/// A map that is ready to light spheres, and the comparison of what came out with the truth.
namespace clerestory::test {

/// A map on the device with its distribution.
struct Lit {
    explicit Lit(RadianceMap lit);
    RadianceMap map;
    TestDevice device;
    DeviceMap on_device;
    Distribution distribution;
    HarmonicShader shader;

    /// A value times 2^exponent of the map.
    [[nodiscard]] double unscaled(double value) const;
};

/// R, G and B of every pixel, or the x, y and z of its normal.
using Pixels = std::vector<std::array<double, 3>>;

Pixels normals_of(const SphereView& view);

/// Pixels of an estimator's planes in the map's own scale.
Pixels pixels_of(const Lit& lit, const SphereView& view, const Buffer<cl_float>& unit_albedo_radiance);

/// Radiance of a white surface with each of the normals, by reference::irradiance at a resolution of 1e-3: right to
/// 4e-8 of the brightest texel's radiance.
Pixels quadrature(const RadianceMap& map, double rotate_y_deg, const Pixels& normals);

/// Root mean square difference over the mean of `truth`.
double relative_rmse(const Pixels& pixels, const Pixels& truth);

}  // namespace clerestory::test
