#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "image.hpp"
#include "reference/shade.hpp"

namespace clerestory::reference {

/// Slow, double-precision harmonics of piecewise-constant maps, by the standard library's special functions. Shares no
/// formula with src/shading/legendre.cpp or kernels/harmonic.cl.

/// Integral over [-1, 1] of max(0, x) P_l(x).
double clamped_cosine_moment(unsigned l);

/// The clamped cosine's Legendre series, cut at `degree`, at x.
double clamped_cosine_cut(unsigned degree, double x);

/// Integral over the row's theta of the normalised associated Legendre function times sin(theta); the functions'
/// normalisation and sign are those of legendre_row_integrals.
double legendre_row_integral(unsigned l, unsigned m, std::size_t row, std::size_t height);

/// Coefficients of a map's real orthonormal harmonics: for each (l, m) in order, R, G, B with cos(m phi), then with
/// sin(m phi).
std::vector<std::array<double, 6>> harmonic_coefficients(const RadianceMap& map, unsigned degree);

/// The same of light from single directions, each of what it adds to a white surface that faces it: pi of that is the
/// integral of its radiance.
std::vector<std::array<double, 6>> harmonic_coefficients(std::span<const Light> lights, unsigned degree);

/// Irradiance over pi of surfaces with given normals (unit length) under the series; the map turned by `rotation`
/// radians.
std::vector<std::array<double, 3>> harmonic_irradiance(const std::vector<std::array<double, 6>>& coefficients,
                                                       unsigned degree, double rotation,
                                                       const std::vector<std::array<double, 3>>& normals);

}  // namespace clerestory::reference
