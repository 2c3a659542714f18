#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace clerestory::reference {

using Vector = std::array<long double, 3>;

/// Integer tables on the host.
struct TablesView {
    std::size_t width = 0;
    std::size_t height = 0;
    std::span<const std::uint32_t> marginal;     ///< [height]
    std::span<const std::uint32_t> conditional;  ///< [height * width]
};

/// First index of `ends` whose end lies above `value`, one after the other; the size where there is none.
std::size_t first_above(std::span<const std::uint32_t> ends, std::uint64_t value);

/// What one pair of 32-bit fractions draws.
struct Drawn {
    std::size_t row = 0;
    std::size_t column = 0;
    long double down = 0;   ///< of the way through the row, even in cos(theta)
    long double along = 0;  ///< of the way through the column, even in phi
    long double pdf = 0;    ///< per steradian
};

/// The upper 31 bits of a fraction pick the row and the column; what is left of the fraction, at the middle of its last
/// bit, is the place within.
Drawn draw(const TablesView& tables, std::uint32_t u_row, std::uint32_t u_column);

/// Angle from +y of a place `down` of the way through a row, even in cos(theta).
long double theta_in_row(std::size_t row, std::size_t height, long double down);

/// (sin theta cos phi, cos theta, sin theta sin phi), then turned about +y by `rotation` radians as a matrix does.
Vector direction(long double theta, long double phi, long double rotation);

/// Solid angle of a texel, from the cosines of its edges: (2 pi / W) (cos theta_top - cos theta_bottom).
long double solid_angle(std::size_t row, std::size_t width, std::size_t height);

}  // namespace clerestory::reference
