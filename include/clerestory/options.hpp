#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "clerestory/export.hpp"

namespace clerestory {

/// How intensity is made of R, G and B.
enum class Luminance { average, rec709 };

/// What becomes of NaN, infinite and negative texels.
enum class BadTexels {
    refuse,  ///< InputError naming their number and the first place
    zero,    ///< their texels become black
};

/// How a map becomes an environment.
struct EnvironmentOptions {
    Luminance luminance = Luminance::average;
    BadTexels bad_texels = BadTexels::refuse;
};

/// Where points of a sample set come from.
enum class Sequence : std::uint32_t {
    random = 0,      ///< Philox4x32-10
    stratified = 1,  ///< one jittered point in each of N cells of equal area, for any N
    sobol = 2,       ///< the first two dimensions of Sobol's sequence, Owen-scrambled; best where N is a power of two
};

/// Every sequence's name at the command line, one's name, and one by its name. Throws UsageError.
CLERESTORY_API std::vector<std::string> sequence_names();
CLERESTORY_API std::string sequence_name(Sequence sequence);
CLERESTORY_API Sequence sequence_by_name(const std::string& name);

/// Where in its texel a sample lies.
enum class TexelPlace { jitter, centre };

/// Every place's name at the command line, one's name, and one by its name. Throws UsageError.
CLERESTORY_API std::vector<std::string> texel_place_names();
CLERESTORY_API std::string texel_place_name(TexelPlace place);
CLERESTORY_API TexelPlace texel_place_by_name(const std::string& name);

/// How samples are drawn.
struct SamplingOptions {
    Sequence sequence = Sequence::random;
    TexelPlace place = TexelPlace::jitter;
    std::uint64_t seed = 1;
    double rotate_y_deg = 0;  ///< added to phi of every direction
    /// Degree of the control variate when shading, 0 (none) .. MAX_CONTROL_DEGREE: the map's harmonic series to this
    /// degree is added as it is, and samples answer only for the rest. Unbiased at every degree.
    unsigned control_degree = 0;

    static constexpr unsigned MAX_CONTROL_DEGREE = 20;

    bool operator==(const SamplingOptions&) const = default;
};

/// The degree and the number of lights by which `harmonic` shades. The defaults leave at most 4e-4 of relative RMSE on
/// the nine photographed maps that they were chosen by; degree 20 leaves 7e-4, and 256 lights leave 1.4e-3 on one.
struct HarmonicOptions {
    std::size_t degree = 30;    ///< 0 .. MAX_DEGREE
    std::size_t lights = 1024;  ///< most texels that may become direct lights, 0 .. MAX_LIGHTS

    static constexpr std::size_t MAX_DEGREE = 40;
    static constexpr std::size_t MAX_LIGHTS = 4096;

    bool operator==(const HarmonicOptions&) const = default;
};

/// How the light that a pixel receives is computed.
enum class Estimator {
    shared,     ///< one sample set for every pixel
    per_pixel,  ///< a fresh set for every pixel
    exact,      ///< the integral itself; needs no samples
    harmonic,   ///< spherical harmonics and the brightest texels as lights; needs no samples
};

/// Every estimator's name at the command line.
CLERESTORY_API std::vector<std::string> estimator_names();
/// The name of an estimator at the command line, and back. Throws UsageError.
CLERESTORY_API std::string estimator_name(Estimator estimator);
CLERESTORY_API Estimator estimator_by_name(const std::string& name);

/// One picture of the sphere.
struct RenderOptions {
    Estimator estimator = Estimator::shared;
    std::size_t samples = 1024;
    std::size_t size = 511;  ///< pixels of a side
    double albedo = 1;
    double scale = 1;  ///< multiplies the environment
    SamplingOptions sampling = {};
    HarmonicOptions harmonic = {};
};

/// 8-bit preview: round(255 clamp(exposure L, 0, 1)^(1/gamma)).
struct ToneOptions {
    double exposure = 1;
    double gamma = 2.2;
};

/// Called now and then with how much of the work is done.
using ProgressFunction = std::function<void(double done, double total)>;

}  // namespace clerestory
