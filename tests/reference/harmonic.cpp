#include "reference/harmonic.hpp"

#include <cmath>
#include <functional>
#include <numbers>

namespace clerestory::reference {
namespace {

constexpr double pi = std::numbers::pi;

/// Composite five-point Gauss quadrature on panels of about 0.02: (0.02 * 40)^10 * 4e-13 of a function of degree 40 is
/// left, which is below rounding.
double integral(double from, double to, const std::function<double(double)>& f) {
    const double inner = std::sqrt(5 - 2 * std::sqrt(10.0 / 7)) / 3;
    const double outer = std::sqrt(5 + 2 * std::sqrt(10.0 / 7)) / 3;
    const double inner_weight = (322 + 13 * std::sqrt(70.0)) / 900;
    const double outer_weight = (322 - 13 * std::sqrt(70.0)) / 900;
    const int panels = 2 + static_cast<int>((to - from) / 0.02);
    const double half = (to - from) / (2 * panels);
    double sum = 0;
    for (int p = 0; p < panels; ++p) {
        const double centre = from + (2 * p + 1) * half;
        sum += 128.0 / 225 * f(centre) + inner_weight * (f(centre - inner * half) + f(centre + inner * half)) +
               outer_weight * (f(centre - outer * half) + f(centre + outer * half));
    }
    return sum * half;
}

/// The standard library's function without its Condon-Shortley sign.
double normalised_legendre(unsigned l, unsigned m, double theta) {
    return (m % 2 == 0 ? 1 : -1) * std::sph_legendre(l, m, theta);
}

}  // namespace

double clamped_cosine_moment(unsigned l) {
    // Over theta, x = cos(theta): near x = 1 the polynomial turns too sharply for even panels of x.
    return integral(
        0, pi / 2, [l](double theta) { return std::cos(theta) * std::sin(theta) * std::legendre(l, std::cos(theta)); });
}

double clamped_cosine_cut(unsigned degree, double x) {
    double sum = 0;
    for (unsigned l = 0; l <= degree; ++l) sum += (l + 0.5) * clamped_cosine_moment(l) * std::legendre(l, x);
    return sum;
}

double legendre_row_integral(unsigned l, unsigned m, std::size_t row, std::size_t height) {
    const double side = pi / static_cast<double>(height);
    const auto i = static_cast<double>(row);
    return integral(i * side, (i + 1) * side,
                    [=](double theta) { return normalised_legendre(l, m, theta) * std::sin(theta); });
}

std::vector<std::array<double, 6>> harmonic_coefficients(const RadianceMap& map, unsigned degree) {
    std::vector<std::array<double, 6>> coefficients;
    const double side = 2 * pi / static_cast<double>(map.width);
    // Integrals over columns of cos(m phi) and sin(m phi) by their antiderivatives.
    std::vector<std::array<double, 2>> column((degree + 1) * map.width);
    for (unsigned m = 0; m <= degree; ++m) {
        for (std::size_t j = 0; j < map.width; ++j) {
            const double a = m * side * static_cast<double>(j);
            const double b = m * side * static_cast<double>(j + 1);
            column[m * map.width + j] = {m == 0 ? side : (std::sin(b) - std::sin(a)) / m,
                                         m == 0 ? 0 : (std::cos(a) - std::cos(b)) / m};
        }
    }
    for (unsigned l = 0; l <= degree; ++l) {
        for (unsigned m = 0; m <= l; ++m) {
            std::array<double, 6> sum{};
            const double norm = m == 0 ? 1 : std::numbers::sqrt2;
            for (std::size_t i = 0; i < map.height; ++i) {
                const double row = norm * legendre_row_integral(l, m, i, map.height);
                for (std::size_t j = 0; j < map.width; ++j) {
                    const auto& [c, s] = column[m * map.width + j];
                    for (std::size_t k = 0; k < 3; ++k) {
                        const auto radiance = static_cast<double>(map.rgb[3 * (i * map.width + j) + k]);
                        sum[k] += row * c * radiance;
                        sum[3 + k] += row * s * radiance;
                    }
                }
            }
            coefficients.push_back(sum);
        }
    }
    return coefficients;
}

std::vector<std::array<double, 6>> harmonic_coefficients(std::span<const Light> lights, unsigned degree) {
    std::vector<std::array<double, 6>> coefficients;
    for (unsigned l = 0; l <= degree; ++l) {
        for (unsigned m = 0; m <= l; ++m) {
            std::array<double, 6> sum{};
            for (const Light& light : lights) {
                const auto y = static_cast<double>(light.direction[1]);
                const double phi =
                    m * std::atan2(static_cast<double>(light.direction[2]), static_cast<double>(light.direction[0]));
                const double value = pi * (m == 0 ? 1 : std::numbers::sqrt2) * normalised_legendre(l, m, std::acos(y));
                for (std::size_t k = 0; k < 3; ++k) {
                    sum[k] += value * std::cos(phi) * static_cast<double>(light.radiance[k]);
                    sum[3 + k] += value * std::sin(phi) * static_cast<double>(light.radiance[k]);
                }
            }
            coefficients.push_back(sum);
        }
    }
    return coefficients;
}

std::vector<std::array<double, 3>> harmonic_irradiance(const std::vector<std::array<double, 6>>& coefficients,
                                                       unsigned degree, double rotation,
                                                       const std::vector<std::array<double, 3>>& normals) {
    std::vector<std::array<double, 3>> sums(normals.size());
    std::size_t at = 0;
    for (unsigned l = 0; l <= degree; ++l) {
        // The Funk-Hecke theorem: a kernel's harmonics of degree l are multiplied by 2 pi times its Legendre moment.
        const double factor = 2 * clamped_cosine_moment(l);
        for (unsigned m = 0; m <= l; ++m, ++at) {
            for (std::size_t p = 0; p < normals.size(); ++p) {
                const auto& n = normals[p];
                const double phi = m * (std::atan2(n[2], n[0]) - rotation);
                const double value =
                    factor * (m == 0 ? 1 : std::numbers::sqrt2) * normalised_legendre(l, m, std::acos(n[1]));
                for (std::size_t k = 0; k < 3; ++k) {
                    sums[p][k] +=
                        value * (coefficients[at][k] * std::cos(phi) + coefficients[at][3 + k] * std::sin(phi));
                }
            }
        }
    }
    return sums;
}

}  // namespace clerestory::reference
