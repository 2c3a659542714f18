#pragma once

#include <array>
#include <cstddef>

#include "image.hpp"

namespace clerestory::reference {

using Vector = std::array<double, 3>;

/// Integral of w over a cell of the sphere, in closed form. Angles in radians, theta from +y.
Vector cell_vector(double theta0, double theta1, double phi0, double phi1);

/// Irradiance of a surface with normal `n` (unit length, in the world) under a map that is constant over each texel:
/// texel by texel, L n . V where the texel lies wholly above the horizon; one that the horizon crosses is quartered
/// until its pieces are smaller than `resolution` radians, and a piece counts as a whole or not at all.
///   returns R, G, B
/// Error: about resolution^2 / 24 of the brightest texel's radiance. Time: texels + 1 / resolution.
/// Source: the integral itself; shares no formula with kernels/exact.cl.
Vector irradiance(const RadianceMap& map, double rotate_y_deg, const Vector& n, double resolution);

}  // namespace clerestory::reference
