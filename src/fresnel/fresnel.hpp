#pragma once

#include <optional>
#include <vector>

#include "cl/device.hpp"

namespace clerestory {

/// The two sides of a smooth dielectric surface, by refractive index; light comes from the first.
struct Media {
    double ior_incident = 1;
    double ior_transmitted = 1.5;
};

/// Reflectance against incidence angle; all arrays are of one length.
struct FresnelCurves {
    std::vector<double> angle_deg;     ///< from the normal, degrees
    std::vector<float> parallel;       ///< electric field in the plane of incidence
    std::vector<float> perpendicular;  ///< electric field across it
    std::vector<float> mean;           ///< unpolarised light
    std::vector<float> schlick;        ///< Schlick's approximation of the mean
};

/// The largest error of Schlick's approximation, and the incidence angle where it is.
struct SchlickError {
    double error = 0;
    double angle_deg = 0;
};

/// What follows from the two indices alone.
struct FresnelFacts {
    double r0 = 0;                        ///< reflectance at normal incidence
    double brewster_deg = 0;              ///< where the parallel reflectance is 0
    std::optional<double> critical_deg;   ///< beyond it all is reflected; only out of the denser medium
    SchlickError max_abs;                 ///< largest |Schlick - mean|
    std::optional<SchlickError> max_rel;  ///< largest |Schlick - mean| / mean; none where the media are equal
};

/// How the kernel calculates: in double, or in pairs of floats on a device without double.
enum class FresnelArithmetic { best, fp64, float_pairs };

constexpr unsigned MIN_FRESNEL_STEPS = 2;
constexpr unsigned MAX_FRESNEL_STEPS = 1'000'000;
constexpr double MIN_IOR = 1e-3;
constexpr double MAX_IOR = 1e3;

/// Throws UsageError, naming the flag, where an index is not a number from MIN_IOR to MAX_IOR.
void check(const Media& media);

/// `steps` angles from 0 to 90 degrees, evenly spaced, both ends included. Throws UsageError.
std::vector<double> incidence_angles(unsigned steps);

/// The four curves at `angle_deg`, each in [0, 90]; calculated on the device. Throws UsageError, DeviceError.
FresnelCurves fresnel_curves(const Device& device, const Media& media, std::vector<double> angle_deg,
                             FresnelArithmetic arithmetic = FresnelArithmetic::best);

/// Exact angles and Schlick's worst errors, found between the angles of any grid. Throws UsageError.
FresnelFacts fresnel_facts(const Media& media);

}  // namespace clerestory
