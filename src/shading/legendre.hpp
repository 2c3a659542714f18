#pragma once

#include <cstddef>
#include <vector>

namespace clerestory {

/// Place of degree l, order m >= 0 in arrays over a triangle of degrees.
constexpr std::size_t triangle_index(std::size_t l, std::size_t m) { return l * (l + 1) / 2 + m; }
/// Elements of a triangle of degrees 0 .. degree.
constexpr std::size_t triangle_size(std::size_t degree) { return triangle_index(degree + 1, 0); }

/// Factors h_l by which the clamped cosine over pi, as a kernel on the sphere, multiplies harmonics of degree l:
/// 1, 2/3, 1/4, 0, -1/24, 0, ... Odd degrees above 1 vanish.
///   returns [degree + 1]
/// Source: Ramamoorthi, Hanrahan, On the relationship between radiance and irradiance, 2001, eq. 24; Basri, Jacobs,
/// Lambertian reflectance and linear subspaces, 2003.
std::vector<double> lambert_factors(std::size_t degree);

/// The even part of the clamped cosine's Legendre series, cut at `degree`, as a polynomial in t = 2 x^2 - 1:
/// max(0, x) = x / 2 + sum_k c_k t^k + what is cut off. In t the coefficients stay small: in x^2, those of degree 20
/// lose three digits more to cancellation.
///   returns [degree / 2 + 1]
std::vector<double> clamped_cosine_series(std::size_t degree);

/// Nodes and weights of Gauss-Legendre quadrature on [-1, 1].
struct Quadrature {
    std::vector<double> node;
    std::vector<double> weight;
};
Quadrature gauss_legendre(std::size_t count);

/// Integrals over rows of equal height in theta of the normalised associated Legendre functions of cos(theta), times
/// sin(theta), for degrees that light a diffuse surface (even ones and 1; others are left 0). Normalised: the integral
/// of P^2 over the sphere is 1, without the factor sqrt(2) that real harmonics of m > 0 have; no Condon-Shortley sign.
///   returns [height * triangle_size(degree)]
/// Error: 1e-13 (measured in tests/harmonic_test.cpp).
std::vector<double> legendre_row_integrals(std::size_t height, std::size_t degree);

}  // namespace clerestory
