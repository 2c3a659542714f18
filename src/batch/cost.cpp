#include "batch/cost.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "shading/exact.hpp"

namespace clerestory {
namespace {

// Nanoseconds on two cores (PoCL 3.1, AVX-512), 511 x 511 pixels and maps of 1024 x 512, files included.
constexpr double SHARED_SAMPLE_NS = 0.02;    // a pixel and a sample, or a pixel and a direct light
constexpr double PER_PIXEL_SAMPLE_NS = 140;  // a pixel and a sample
constexpr double EXACT_LOOKUP_NS = 3.4;      // one of ExactIntegrator::estimated_operations
constexpr double PROJECTION_NS = 10;         // a texel
constexpr double OUTPUT_NS = 25;             // a pixel of the square and a file
constexpr double COMPOSE_NS = 10;            // a pixel of the square
constexpr double PICTURE_NS = 1e6;
constexpr double TEXEL_NS = 20;  // a texel, decoding and tables
constexpr double MAP_NS = 5e6;

// As src/shading/ and src/sampling/ lay their arrays out.
constexpr std::size_t SAMPLE_BYTES = 64;
constexpr std::size_t EXACT_TEXEL_BYTES = 24;  // three sums in double, in each of two tables
constexpr std::size_t LARGEST_SET = std::size_t{1} << 20;

std::size_t map_bytes(std::size_t width, std::size_t height) { return 3 * sizeof(float) * width * height; }

double sphere_pixels(std::size_t size) {
    const auto side = static_cast<double>(size);
    return side * side * std::numbers::pi / 4;
}

double shading_ns(const RenderOptions& options, double texels, std::size_t width, std::size_t height) {
    const double pixels = sphere_pixels(options.size);
    const auto samples = static_cast<double>(options.samples);
    switch (options.estimator) {
        case Estimator::shared:
            return SHARED_SAMPLE_NS * pixels * samples;
        case Estimator::per_pixel:
            return PER_PIXEL_SAMPLE_NS * pixels * samples;
        case Estimator::exact:
            return EXACT_LOOKUP_NS *
                   ExactIntegrator::estimated_operations(static_cast<std::size_t>(pixels), width, height);
        case Estimator::harmonic:
            return PROJECTION_NS * texels + SHARED_SAMPLE_NS * pixels * static_cast<double>(options.harmonic.lights);
    }
    return 0;
}

}  // namespace

std::uint64_t picture_cost_ns(const RenderOptions& options, std::size_t map_width, std::size_t map_height,
                              std::size_t outputs) {
    const auto square = static_cast<double>(options.size * options.size);
    const double texels = static_cast<double>(map_width) * static_cast<double>(map_height);
    return static_cast<std::uint64_t>(std::llround(PICTURE_NS + shading_ns(options, texels, map_width, map_height) +
                                                   square * (COMPOSE_NS + OUTPUT_NS * static_cast<double>(outputs))));
}

std::uint64_t map_cost_ns(std::size_t width, std::size_t height) {
    return static_cast<std::uint64_t>(
        std::llround(MAP_NS + TEXEL_NS * static_cast<double>(width) * static_cast<double>(height)));
}

std::size_t reading_bytes(std::size_t width, std::size_t height) { return 4 * map_bytes(width, height); }

std::size_t scene_bytes(std::size_t width, std::size_t height) {
    // A table entry a texel, and guides of a quarter of that.
    return map_bytes(width, height) + 5 * width * height;
}

std::size_t picture_bytes(std::size_t size) {
    // Float RGBA, the same as EXR, four bytes of preview and up to as many of PNG.
    return size * size * (16 + 16 + 4 + 4);
}

std::size_t estimator_bytes(const RenderOptions& options, std::size_t texels) {
    // Normals, white radiance and float RGBA on the device.
    const std::size_t view = options.size * options.size * (12 + 12 + 16);
    if (options.estimator == Estimator::shared) return view + SAMPLE_BYTES * std::min(options.samples, LARGEST_SET);
    if (options.estimator == Estimator::exact) {
        return view + 2 * std::min(ExactIntegrator::TABLE_BYTES, EXACT_TEXEL_BYTES * texels);
    }
    return view;
}

}  // namespace clerestory
