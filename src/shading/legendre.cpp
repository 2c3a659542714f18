#include "shading/legendre.hpp"

#include <cmath>
#include <numbers>

namespace clerestory {
namespace {

using std::numbers::pi;

/// alpha of x P_l = alpha_{l+1} P_{l+1} + alpha_l P_{l-1} for normalised functions of order m.
double recurrence_factor(double l, double m) { return std::sqrt((l * l - m * m) / (4 * l * l - 1)); }

/// The recurrence's factors for a whole triangle, so that rows need no roots.
///   returns [triangle_size(degree + 1)]
std::vector<double> recurrence_factors(std::size_t degree) {
    std::vector<double> alpha(triangle_size(degree + 1));
    for (std::size_t l = 1; l <= degree + 1; ++l) {
        for (std::size_t m = 0; m <= l; ++m) {
            alpha[triangle_index(l, m)] = recurrence_factor(static_cast<double>(l), static_cast<double>(m));
        }
    }
    return alpha;
}

/// Adds weight * P to `sums` for every degree and order, at cos(theta) = x, sin(theta) = s.
void add_functions(double x, double s, double weight, std::size_t degree, const std::vector<double>& alpha,
                   double* sums) {
    double first = weight / std::sqrt(4 * pi);  // P_mm
    for (std::size_t m = 0; m <= degree; ++m) {
        if (m > 0) first *= s * std::sqrt(1 + 1 / (2 * static_cast<double>(m)));
        double before = 0;
        double here = first;
        for (std::size_t l = m; l <= degree; ++l) {
            if (l % 2 == 0 || l == 1) sums[triangle_index(l, m)] += here;
            const double after = (x * here - alpha[triangle_index(l, m)] * before) / alpha[triangle_index(l + 1, m)];
            before = here;
            here = after;
        }
    }
}

}  // namespace

std::vector<double> lambert_factors(std::size_t degree) {
    std::vector<double> factors(degree + 1, 0.0);
    factors[0] = 1;
    if (degree >= 1) factors[1] = 2.0 / 3;
    // h_l = 2 (-1)^(l/2 - 1) / ((l + 2)(l - 1)) * l! / (2^l (l/2)!^2); the last quotient is the product of (l - 1) / l.
    double central = 1;
    for (std::size_t l = 2; l <= degree; l += 2) {
        const auto d = static_cast<double>(l);
        central *= (d - 1) / d;
        factors[l] = (l / 2 % 2 == 1 ? 2 : -2) * central / ((d + 2) * (d - 1));
    }
    return factors;
}

std::vector<double> clamped_cosine_series(std::size_t degree) {
    const std::vector<double> factors = lambert_factors(degree);
    const std::size_t terms = degree / 2 + 1;
    // Legendre polynomials of even degree as polynomials in t, two degrees at a step (see evaluate_harmonics).
    std::vector<double> before(terms, 0.0);
    std::vector<double> here(terms, 0.0);
    std::vector<double> sum(terms, 0.0);
    here[0] = 1;
    for (std::size_t l = 0; l <= degree; l += 2) {
        const auto d = static_cast<double>(l);
        for (std::size_t k = 0; k < terms; ++k) sum[k] += (2 * d + 1) / 4 * factors[l] * here[k];
        // x P_l = ((l + 1) P_{l+1} + l P_{l-1}) / (2 l + 1), applied twice; x^2 = (t + 1) / 2.
        const double up = (d + 1) / (2 * d + 1) * (d + 2) / (2 * d + 3);
        const double level =
            (d + 1) / (2 * d + 1) * (d + 1) / (2 * d + 3) + (l == 0 ? 0 : d / (2 * d + 1) * d / (2 * d - 1));
        const double down = l == 0 ? 0 : d / (2 * d + 1) * (d - 1) / (2 * d - 1);
        std::vector<double> after(terms, 0.0);
        for (std::size_t k = 0; k < terms; ++k) {
            const double shifted = k == 0 ? 0 : here[k - 1];
            after[k] = ((shifted + here[k]) / 2 - level * here[k] - down * before[k]) / up;
        }
        before = here;
        here = after;
    }
    return sum;
}

Quadrature gauss_legendre(std::size_t count) {
    Quadrature rule{std::vector<double>(count), std::vector<double>(count)};
    const auto n = static_cast<double>(count);
    constexpr int newton_steps = 8;  // from these starts the error squares each time: four are enough
    for (std::size_t i = 0; i < count; ++i) {
        double x = std::cos(pi * (static_cast<double>(i) + 0.75) / (n + 0.5));
        double slope = 0;
        for (int step = 0; step < newton_steps; ++step) {
            double before = 0;
            double here = 1;
            for (std::size_t l = 0; l < count; ++l) {
                const auto d = static_cast<double>(l);
                const double after = ((2 * d + 1) * x * here - d * before) / (d + 1);
                before = here;
                here = after;
            }
            slope = n * (before - x * here) / (1 - x * x);
            x -= here / slope;
        }
        rule.node[i] = x;
        rule.weight[i] = 2 / ((1 - x * x) * slope * slope);
    }
    return rule;
}

std::vector<double> legendre_row_integrals(std::size_t height, std::size_t degree) {
    const std::size_t size = triangle_size(degree);
    const std::vector<double> alpha = recurrence_factors(degree);
    const double row_height = pi / static_cast<double>(height);
    // The integrand is a trigonometric polynomial of degree l + 1 in theta. Quadrature with n nodes on a half-width a
    // converges faster than geometrically once n exceeds (l + 1) a / 2; the margin brings it to rounding.
    const double phase = static_cast<double>(degree + 1) * row_height / 2;
    const Quadrature rule = gauss_legendre(5 + static_cast<std::size_t>(std::ceil(phase)));
    std::vector<double> integrals(height * size, 0.0);
    for (std::size_t i = 0; 2 * i < height; ++i) {
        double* const row = integrals.data() + i * size;
        for (std::size_t k = 0; k < rule.node.size(); ++k) {
            const double theta = row_height * (static_cast<double>(i) + 0.5 + 0.5 * rule.node[k]);
            const double s = std::sin(theta);
            add_functions(std::cos(theta), s, rule.weight[k] * row_height / 2 * s, degree, alpha, row);
        }
        // P(-x) = (-1)^(l + m) P(x).
        double* const mirrored = integrals.data() + (height - 1 - i) * size;
        if (mirrored == row) continue;
        for (std::size_t l = 0; l <= degree; ++l) {
            for (std::size_t m = 0; m <= l; ++m) {
                const std::size_t at = triangle_index(l, m);
                mirrored[at] = (l + m) % 2 == 0 ? row[at] : -row[at];
            }
        }
    }
    return integrals;
}

}  // namespace clerestory
