#include "fresnel/fresnel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "cl/buffer.hpp"
#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "error.hpp"
#include "fresnel/reflectance.hpp"

namespace clerestory {
namespace {

long double ratio(const Media& media) {
    return static_cast<long double>(media.ior_transmitted) / static_cast<long double>(media.ior_incident);
}

/// eta^2 - 1 without cancellation.
long double squared_ratio_less_one(const Media& media) {
    const long double n1 = media.ior_incident;
    const long double n2 = media.ior_transmitted;
    return (n2 - n1) * (n2 + n1) / (n1 * n1);
}

long double normal_reflectance(const Media& media) {
    const long double n1 = media.ior_incident;
    const long double n2 = media.ior_transmitted;
    const long double amplitude = (n1 - n2) / (n1 + n2);
    return amplitude * amplitude;
}

/// pi/2 - critical angle, radians; 0 where there is none.
long double critical_complement(const Media& media) {
    const long double squared = -squared_ratio_less_one(media);
    return squared > 0 ? std::atan2(std::sqrt(squared), ratio(media)) : 0;
}

bool has_critical_angle(const Media& media) { return media.ior_incident > media.ior_transmitted; }

/// Values as the kernel takes them: each the nearest float, then the float nearest to the rest.
class Pairs {
  public:
    void push(long double value) {
        const auto hi = static_cast<float>(value);
        floats_.push_back(hi);
        floats_.push_back(static_cast<float>(value - static_cast<long double>(hi)));
    }
    [[nodiscard]] std::span<const float> floats() const { return floats_; }

  private:
    std::vector<float> floats_;
};

Pairs media_pairs(const Media& media) {
    const long double eta = ratio(media);
    Pairs pairs;
    pairs.push(eta);
    pairs.push(squared_ratio_less_one(media));
    pairs.push(std::hypot(1.0L, eta));
    pairs.push(critical_complement(media));
    pairs.push(normal_reflectance(media));
    return pairs;
}

struct AnglePairs {
    Pairs angle, complement, from_brewster, from_critical;
};

/// The differences are taken here, in long double: near the critical angle and near Brewster's they carry all the
/// digits that the reflectance has. Of the angle and its complement the smaller one has the finer last digit.
AnglePairs angle_pairs(const Media& media, const std::vector<double>& angle_deg) {
    const long double brewster = std::atan(ratio(media));
    const long double brewster_complement = std::atan(1 / ratio(media));
    const long double critical_c = critical_complement(media);
    AnglePairs pairs;
    for (const double degrees : angle_deg) {
        const long double angle = static_cast<long double>(degrees) * RADIANS_PER_DEGREE;
        const long double complement = (RIGHT_ANGLE_DEG - static_cast<long double>(degrees)) * RADIANS_PER_DEGREE;
        pairs.angle.push(angle);
        pairs.complement.push(complement);
        pairs.from_brewster.push(angle < complement ? brewster - angle : complement - brewster_complement);
        pairs.from_critical.push(complement - critical_c);
    }
    return pairs;
}

std::string defines(const Device& device, FresnelArithmetic arithmetic) {
    if (arithmetic == FresnelArithmetic::best) {
        arithmetic = device.traits().fp64 ? FresnelArithmetic::fp64 : FresnelArithmetic::float_pairs;
    }
    return arithmetic == FresnelArithmetic::fp64 ? "-DREAL_FP64" : "";
}

void check_index(const char* flag, double ior) {
    if (std::isfinite(ior) && ior >= MIN_IOR && ior <= MAX_IOR) return;
    throw UsageError(
        fmt::format("{} {}: a refractive index is a number from {} to {}, such as 1 for air or 1.5 for glass", flag,
                    ior, MIN_IOR, MAX_IOR));
}

using Function = std::function<long double(long double)>;

/// Angles at which a largest error is looked for: an even grid, and one that closes in on `end` by a constant factor,
/// because media that differ little have all their reflectance within a narrow band below it.
std::vector<long double> search_angles(long double end) {
    constexpr int EVEN = 2000;
    constexpr int CLOSING = 1600;
    constexpr long double PER_HALVING = 32;  // closes in to 90 degrees * 2^-50
    std::vector<long double> angles;
    for (int i = 0; i <= EVEN; ++i) angles.push_back(end * static_cast<long double>(i) / EVEN);
    for (int i = 1; i <= CLOSING; ++i)
        angles.push_back(end - end * std::exp2(-static_cast<long double>(i) / PER_HALVING));
    std::sort(angles.begin(), angles.end());
    return angles;
}

/// Where f is largest between `low` and `high`, which hold one peak: golden-section search.
/// Source: Kiefer, Sequential minimax search for a maximum, 1953.
long double peak_between(const Function& f, long double low, long double high) {
    constexpr int STEPS = 60;  // the bracket shrinks by 0.618^60, 3e-13 of a grid step
    const long double share = 1 / std::numbers::phi_v<long double>;
    for (int i = 0; i < STEPS; ++i) {
        const long double left = high - share * (high - low);
        const long double right = low + share * (high - low);
        (f(left) > f(right) ? high : low) = f(left) > f(right) ? right : left;
    }
    return (low + high) / 2;
}

SchlickError largest(const Function& f, long double end) {
    const auto angles = search_angles(end);
    std::vector<long double> values;
    for (const auto angle : angles) values.push_back(f(angle));
    const auto best = static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
    const long double low = angles[best == 0 ? 0 : best - 1];
    const long double high = angles[std::min(best + 1, angles.size() - 1)];
    const long double peak = peak_between(f, low, high);
    // A peak at the end of the range is the grid's own.
    if (f(peak) < values[best]) return {static_cast<double>(values[best]), static_cast<double>(angles[best])};
    return {static_cast<double>(f(peak)), static_cast<double>(peak)};
}

}  // namespace

void check(const Media& media) {
    check_index("--ior-incident", media.ior_incident);
    check_index("--ior-transmitted", media.ior_transmitted);
}

std::vector<double> incidence_angles(unsigned steps) {
    if (steps < MIN_FRESNEL_STEPS || steps > MAX_FRESNEL_STEPS) {
        throw UsageError(
            fmt::format("--steps {}: a curve has from {} to {} angles", steps, MIN_FRESNEL_STEPS, MAX_FRESNEL_STEPS));
    }
    std::vector<double> angles(steps);
    for (unsigned i = 0; i < steps; ++i) {
        angles[i] = static_cast<double>(RIGHT_ANGLE_DEG) * i / (steps - 1);
    }
    return angles;
}

FresnelCurves fresnel_curves(const Device& device, const Media& media, std::vector<double> angle_deg,
                             FresnelArithmetic arithmetic) {
    check(media);
    for (const double angle : angle_deg) {
        if (!(angle >= 0 && angle <= static_cast<double>(RIGHT_ANGLE_DEG))) {
            throw UsageError(fmt::format("incidence angle {}: it is from 0 to 90 degrees", angle));
        }
    }
    const std::size_t count = angle_deg.size();
    const auto pairs = angle_pairs(media, angle_deg);
    const Program program(device, "fresnel.cl", defines(device, arithmetic));
    Kernel<Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, cl_uint> reflect(device, program,
                                                                                                    "reflect_angles");
    const Floats between(device, "media", media_pairs(media).floats());
    const Floats angle(device, "angle", pairs.angle.floats());
    const Floats complement(device, "complement", pairs.complement.floats());
    const Floats from_brewster(device, "from_brewster", pairs.from_brewster.floats());
    const Floats from_critical(device, "from_critical", pairs.from_critical.floats());
    const Floats parallel(device, "parallel", count);
    const Floats perpendicular(device, "perpendicular", count);
    const Floats mean(device, "mean", count);
    const Floats schlick(device, "schlick", count);
    reflect(device.thin(count), between, angle, complement, from_brewster, from_critical, parallel, perpendicular, mean,
            schlick, static_cast<cl_uint>(count));
    return {std::move(angle_deg), parallel.download(), perpendicular.download(), mean.download(), schlick.download()};
}

FresnelFacts fresnel_facts(const Media& media) {
    check(media);
    FresnelFacts facts;
    facts.r0 = static_cast<double>(normal_reflectance(media));
    facts.brewster_deg = static_cast<double>(std::atan(ratio(media)) / RADIANS_PER_DEGREE);
    long double end = RIGHT_ANGLE_DEG;
    if (has_critical_angle(media)) {
        end -= critical_complement(media) / RADIANS_PER_DEGREE;
        facts.critical_deg = static_cast<double>(end);
    }
    if (media.ior_incident == media.ior_transmitted) {
        // Nothing is reflected below 90 degrees, and Schlick's term rises to 1 there.
        facts.max_abs = {1, static_cast<double>(RIGHT_ANGLE_DEG)};
        return facts;
    }
    const auto error = [&](long double angle) {
        const auto r = reflectance(media.ior_incident, media.ior_transmitted, angle);
        return std::pair(std::abs(r.schlick - r.mean), r.mean);
    };
    facts.max_abs = largest([&](long double angle) { return error(angle).first; }, end);
    facts.max_rel = largest(
        [&](long double angle) {
            const auto [difference, mean] = error(angle);
            return difference / mean;
        },
        end);
    return facts;
}

}  // namespace clerestory
