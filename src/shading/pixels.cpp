#include "shading/pixels.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <vector>

#include "cl/kernel.hpp"

namespace clerestory {
namespace {

/// The squares of a grid along a Hilbert curve, at every step the next neighbour.
/// Source: Hilbert, Ueber die stetige Abbildung einer Linie auf ein Flaechenstueck, 1891.
///   side     of the square at (x, y), a power of two
///   swapped  the curve's square is mirrored in its diagonal
///   turned   it is turned by 180 degrees
///   wanted   whether the curve enters a square: (x, y, side)
template <class Wanted, class Visit>
void walk_hilbert(std::size_t x, std::size_t y, std::size_t side, bool swapped, bool turned, const Wanted& wanted,
                  const Visit& visit) {
    if (!wanted(x, y, side)) return;
    if (side == 1) {
        visit(x, y);
        return;
    }
    const std::size_t half = side / 2;
    constexpr std::array<std::array<bool, 2>, 4> QUADRANTS = {
        {{false, false}, {false, true}, {true, true}, {true, false}}};
    for (std::size_t q = 0; q < QUADRANTS.size(); ++q) {
        const bool u = QUADRANTS[q][swapped ? 1 : 0] != turned;
        const bool v = QUADRANTS[q][swapped ? 0 : 1] != turned;
        const bool at_an_end = q == 0 || q == 3;
        walk_hilbert(x + (u ? half : 0), y + (v ? half : 0), half, swapped != at_an_end, turned != (q == 3), wanted,
                     visit);
    }
}

/// A pixel of the sphere and its normal.
struct SpherePixel {
    std::size_t index;
    std::array<double, 3> normal;
};

/// The pixels of a picture of the given side that show the sphere, along a Hilbert curve.
std::vector<SpherePixel> sphere_pixels(std::size_t size) {
    std::vector<SpherePixel> pixels;
    pixels.reserve(size * size);  // a little more than the disc holds
    const auto s = static_cast<double>(size);
    const auto across = [&](std::size_t p) { return 2 * (static_cast<double>(p) + 0.5) / s - 1; };
    // Squares beside the picture or the disc are passed over whole.
    const auto wanted = [&](std::size_t x, std::size_t y, std::size_t side) {
        if (x >= size || y >= size) return false;
        const double dx = std::clamp(0.0, across(x), across(x + side - 1));
        const double dy = std::clamp(0.0, across(y), across(y + side - 1));
        return dx * dx + dy * dy < 1;
    };
    const auto visit = [&](std::size_t px, std::size_t py) {
        const double x = across(px);
        const double y = 1 - 2 * (static_cast<double>(py) + 0.5) / s;
        pixels.push_back({py * size + px, {x, y, std::sqrt(1 - (x * x + y * y))}});
    };
    walk_hilbert(0, 0, std::bit_ceil(size), false, false, wanted, visit);
    return pixels;
}

/// Axis and sine of the half angle of a cone about normals, see SphereView::cone.
std::array<float, 4> cone_about(std::span<const SpherePixel> pixels) {
    // Directions and normals in float32 are off by 1e-6 together.
    constexpr double MARGIN = 4e-6;
    std::array<double, 3> axis{};
    for (const auto& p : pixels) {
        for (std::size_t c = 0; c < 3; ++c) axis[c] += p.normal[c];
    }
    const double length = std::hypot(axis[0], axis[1], axis[2]);  // every normal has a positive z
    double least = 1;
    for (const auto& p : pixels) {
        least = std::min(least, (p.normal[0] * axis[0] + p.normal[1] * axis[1] + p.normal[2] * axis[2]) / length);
    }
    const double sine = least > 0 ? std::sqrt(1 - least * least) + MARGIN : 2;
    return {static_cast<float>(axis[0] / length), static_cast<float>(axis[1] / length),
            static_cast<float>(axis[2] / length), static_cast<float>(sine)};
}

}  // namespace

SphereView::SphereView(const Device& device, std::size_t size_of_side) : size(size_of_side) {
    const std::vector<SpherePixel> pixels = sphere_pixels(size);
    count = pixels.size();
    const std::size_t groups = (count + GROUP_PIXELS - 1) / GROUP_PIXELS;
    stride = groups * GROUP_PIXELS;
    std::vector<cl_uint> indices(stride, 0);
    std::vector<cl_float> planes(3 * stride, 0.0F);
    std::fill(planes.begin() + static_cast<std::ptrdiff_t>(2 * stride), planes.end(), 1.0F);
    for (std::size_t i = 0; i < count; ++i) {
        indices[i] = narrow(pixels[i].index);
        for (std::size_t c = 0; c < 3; ++c) planes[c * stride + i] = static_cast<float>(pixels[i].normal[c]);
    }
    std::vector<cl_float> cones;
    for (std::size_t first = 0; first < count; first += GROUP_PIXELS) {
        const auto about = cone_about({&pixels[first], std::min(GROUP_PIXELS, count - first)});
        cones.insert(cones.end(), about.begin(), about.end());
    }
    pixel = Uints(device, "the sphere's pixels", std::span<const cl_uint>(indices));
    normal = Floats(device, "the sphere's normals", std::span<const cl_float>(planes));
    cone = Floats(device, "the sphere's cones", std::span<const cl_float>(cones));
}

Floats SphereView::planes(const Device& device) const { return {device, "the sphere's radiance", 3 * stride}; }

}  // namespace clerestory
