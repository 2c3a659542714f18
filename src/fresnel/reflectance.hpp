#pragma once

#include <numbers>

namespace clerestory {

inline constexpr long double RIGHT_ANGLE_DEG = 90;
inline constexpr long double RADIANS_PER_DEGREE = std::numbers::pi_v<long double> / 180;

struct Reflectance {
    long double parallel = 0;
    long double perpendicular = 0;
    long double mean = 0;
    long double schlick = 0;
};

/// Reflectance of a smooth dielectric at `angle_deg`, in [0, 90], in long double by the textbook's amplitudes and
/// Snell's law. Out of the denser medium the cosine of transmission is taken through the distance from the critical
/// angle, without which even long double is off by 1e-6 one double's ulp beside it (media 1e-7 apart).
/// Source: Hecht, Optics, 4.6.2; Schlick 1994.
Reflectance reflectance(long double ior_incident, long double ior_transmitted, long double angle_deg);

}  // namespace clerestory
