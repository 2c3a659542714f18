#include "reference/irradiance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace clerestory::reference {
namespace {

struct Cell {
    double theta0, theta1, phi0, phi1;
    [[nodiscard]] Vector vector() const { return cell_vector(theta0, theta1, phi0, phi1); }
    /// No point of the cell is farther from its centre than this, in radians.
    [[nodiscard]] double radius() const { return 0.5 * ((theta1 - theta0) + (phi1 - phi0)); }
    [[nodiscard]] double cosine_at_centre(const Vector& n) const {
        const double theta = 0.5 * (theta0 + theta1);
        const double phi = 0.5 * (phi0 + phi1);
        return std::sin(theta) * (n[0] * std::cos(phi) + n[2] * std::sin(phi)) + std::cos(theta) * n[1];
    }
};

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Integral of max(0, n . w) over the cell.
double clipped_cosine(const Cell& cell, const Vector& n, double resolution) {
    const double cosine = cell.cosine_at_centre(n);
    const double radius = cell.radius();
    // A cosine changes by no more than the angle.
    if (cosine >= radius) return dot(n, cell.vector());
    if (cosine <= -radius) return 0;
    const double height = cell.theta1 - cell.theta0;
    const double width = cell.phi1 - cell.phi0;
    if (std::max(height, width) < resolution) return std::max(0.0, dot(n, cell.vector()));
    const double theta = 0.5 * (cell.theta0 + cell.theta1);
    const double phi = 0.5 * (cell.phi0 + cell.phi1);
    // Only the longer side is cut where the cell is oblong.
    if (width > 2 * height) {
        return clipped_cosine({cell.theta0, cell.theta1, cell.phi0, phi}, n, resolution) +
               clipped_cosine({cell.theta0, cell.theta1, phi, cell.phi1}, n, resolution);
    }
    if (height > 2 * width) {
        return clipped_cosine({cell.theta0, theta, cell.phi0, cell.phi1}, n, resolution) +
               clipped_cosine({theta, cell.theta1, cell.phi0, cell.phi1}, n, resolution);
    }
    return clipped_cosine({cell.theta0, theta, cell.phi0, phi}, n, resolution) +
           clipped_cosine({cell.theta0, theta, phi, cell.phi1}, n, resolution) +
           clipped_cosine({theta, cell.theta1, cell.phi0, phi}, n, resolution) +
           clipped_cosine({theta, cell.theta1, phi, cell.phi1}, n, resolution);
}

}  // namespace

Vector cell_vector(double theta0, double theta1, double phi0, double phi1) {
    const double width = phi1 - phi0;
    const double middle = 0.5 * (phi0 + phi1);
    // Integral of sin^2, and of sin cos, over theta; differences as products, which lose nothing in small cells.
    const double sum = theta0 + theta1;
    const double height = theta1 - theta0;
    const double sine_squared = 0.5 * (height - std::cos(sum) * std::sin(height));
    const double sine_cosine = 0.5 * std::sin(sum) * std::sin(height);
    const double chord = 2 * std::sin(0.5 * width);
    return {sine_squared * chord * std::cos(middle), sine_cosine * width, sine_squared * chord * std::sin(middle)};
}

Vector irradiance(const RadianceMap& map, double rotate_y_deg, const Vector& n, double resolution) {
    const double turn = rotate_y_deg * std::numbers::pi / 180;
    const double theta_step = std::numbers::pi / static_cast<double>(map.height);
    const double phi_step = 2 * std::numbers::pi / static_cast<double>(map.width);
    Vector sum{};
    for (std::size_t i = 0; i < map.height; ++i) {
        for (std::size_t j = 0; j < map.width; ++j) {
            const float* texel = map.rgb.data() + 3 * (i * map.width + j);
            if (texel[0] == 0 && texel[1] == 0 && texel[2] == 0) continue;
            const auto row = static_cast<double>(i);
            const auto column = static_cast<double>(j);
            const double part = clipped_cosine(
                {theta_step * row, theta_step * (row + 1), phi_step * column + turn, phi_step * (column + 1) + turn}, n,
                resolution);
            for (std::size_t c = 0; c < 3; ++c) sum[c] += static_cast<double>(texel[c]) * part;
        }
    }
    return sum;
}

}  // namespace clerestory::reference
