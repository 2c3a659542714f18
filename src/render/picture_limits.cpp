#include "render/picture_limits.hpp"

#include <fmt/format.h>

#include "error.hpp"

namespace clerestory::limits {
namespace {

/// NaN is in no range.
template <class Value>
void check_range(const char* name, Value value, Value least, Value largest) {
    if (value >= least && value <= largest) return;
    throw UsageError(fmt::format("{} {}: it is a number from {} to {}", name, value, least, largest));
}

}  // namespace

void check(const SamplingOptions& options) {
    check_range("rotation", options.rotate_y_deg, -LARGEST_ROTATION_DEG, LARGEST_ROTATION_DEG);
    check_range("control degree", options.control_degree, 0U, SamplingOptions::MAX_CONTROL_DEGREE);
}

void check(const RenderOptions& options) {
    check(options.sampling);
    check_range("samples", options.samples, std::size_t{1}, LARGEST_COUNT);
    check_range("size", options.size, std::size_t{1}, LARGEST_SIDE);
    check_range("albedo", options.albedo, 0.0, LARGEST_ALBEDO);
    check_range("scale", options.scale, 0.0, LARGEST_SCALE);
    check_range("harmonic degree", options.harmonic.degree, std::size_t{0}, HarmonicOptions::MAX_DEGREE);
    check_range("lights", options.harmonic.lights, std::size_t{0}, HarmonicOptions::MAX_LIGHTS);
}

void check(const ToneOptions& options) {
    check_range("exposure", options.exposure, 0.0, LARGEST_EXPOSURE);
    check_range("gamma", options.gamma, 1 / LARGEST_GAMMA, LARGEST_GAMMA);
}

}  // namespace clerestory::limits
