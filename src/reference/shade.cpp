#include "reference/shade.hpp"

#include <cmath>
#include <numbers>

namespace clerestory::reference {

Vector shade(const Vector& normal, std::span<const Light> lights) {
    Vector sum{};
    for (const Light& light : lights) {
        long double cosine = 0;
        for (std::size_t c = 0; c < 3; ++c) cosine += normal[c] * light.direction[c];
        if (cosine <= 0) continue;
        for (std::size_t c = 0; c < 3; ++c) sum[c] += cosine * light.radiance[c];
    }
    return sum;
}

Light light_of_sample(const Vector& direction, const Vector& radiance, long double pdf, std::size_t count) {
    const long double share = 1 / (std::numbers::pi_v<long double> * static_cast<long double>(count) * pdf);
    return {direction, {radiance[0] * share, radiance[1] * share, radiance[2] * share}};
}

std::vector<SpherePixel> sphere_pixels(std::size_t size) {
    std::vector<SpherePixel> pixels;
    const auto s = static_cast<long double>(size);
    for (std::size_t index = 0; index < size * size; ++index) {
        const std::size_t column = index % size;
        const std::size_t row = index / size;
        const long double x = (2 * static_cast<long double>(column) + 1) / s - 1;
        const long double y = 1 - (2 * static_cast<long double>(row) + 1) / s;
        if (x * x + y * y < 1) pixels.push_back({index, {x, y, std::sqrt(1 - x * x - y * y)}});
    }
    return pixels;
}

}  // namespace clerestory::reference
