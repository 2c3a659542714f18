#include "fresnel/reflectance.hpp"

#include <cmath>
#include <numbers>

namespace clerestory {
namespace {

/// Cosine of transmission; negative where nothing is transmitted. With d = critical angle - incidence,
/// sin(incidence) = eta cos d - cos(critical) sin d, so 1 - sin(transmission) = (1 - cos d) + cos(critical) sin d /
/// eta.
long double transmitted_cosine(long double n1, long double n2, long double angle_deg) {
    const long double sine = std::sin(angle_deg * RADIANS_PER_DEGREE);
    const long double sine_t = n1 * sine / n2;
    if (n1 <= n2) return std::sqrt((1 - sine_t) * (1 + sine_t));
    const long double critical_cosine = std::sqrt((n1 - n2) * (n1 + n2)) / n1;
    const long double complement = (RIGHT_ANGLE_DEG - angle_deg) * RADIANS_PER_DEGREE;
    const long double d = complement - std::atan2(critical_cosine, n2 / n1);
    if (d < 0) return -1;
    const long double half_sine = std::sin(d / 2);
    const long double one_less_sine = 2 * half_sine * half_sine + critical_cosine * std::sin(d) * n1 / n2;
    return std::sqrt(one_less_sine * (1 + sine_t));
}

}  // namespace

Reflectance reflectance(long double n1, long double n2, long double angle_deg) {
    const long double cosine = std::sin((RIGHT_ANGLE_DEG - angle_deg) * RADIANS_PER_DEGREE);
    const long double cosine_t = transmitted_cosine(n1, n2, angle_deg);
    if (angle_deg >= RIGHT_ANGLE_DEG || cosine_t < 0) return {1, 1, 1, 1};
    if (n1 == n2) {
        // The amplitudes are 0; rounding must not say otherwise.
        return {0, 0, 0, std::pow(1 - cosine, 5.0L)};
    }
    const long double perpendicular = (n1 * cosine - n2 * cosine_t) / (n1 * cosine + n2 * cosine_t);
    const long double parallel = (n2 * cosine - n1 * cosine_t) / (n2 * cosine + n1 * cosine_t);
    const long double normal = (n1 - n2) / (n1 + n2);
    const long double r0 = normal * normal;
    const long double schlick_cosine = n1 > n2 ? cosine_t : cosine;
    Reflectance r;
    r.parallel = parallel * parallel;
    r.perpendicular = perpendicular * perpendicular;
    r.mean = (r.parallel + r.perpendicular) / 2;
    r.schlick = r0 + (1 - r0) * std::pow(1 - schlick_cosine, 5.0L);
    return r;
}

}  // namespace clerestory
