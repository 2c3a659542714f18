#include "lit_sphere.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "reference/irradiance.hpp"
#include "shading/pixels.hpp"

namespace clerestory::test {

Lit::Lit(RadianceMap lit)
    : map(std::move(lit)),
      on_device(device, map),
      distribution(TableBuilder(device).build(on_device)),
      shader(device) {}

double Lit::unscaled(double value) const { return std::ldexp(value, distribution.exponent); }

Pixels normals_of(const SphereView& view) {
    const std::vector<float> planes = view.normal.download();
    Pixels normals(view.count);
    for (std::size_t p = 0; p < view.count; ++p) {
        for (std::size_t c = 0; c < 3; ++c) normals[p][c] = static_cast<double>(planes[c * view.stride + p]);
    }
    return normals;
}

Pixels pixels_of(const Lit& lit, const SphereView& view, const Buffer<cl_float>& unit_albedo_radiance) {
    const std::vector<float> planes = unit_albedo_radiance.download();
    Pixels pixels(view.count);
    for (std::size_t p = 0; p < view.count; ++p) {
        for (std::size_t c = 0; c < 3; ++c) {
            pixels[p][c] = lit.unscaled(static_cast<double>(planes[c * view.stride + p]));
        }
    }
    return pixels;
}

Pixels quadrature(const RadianceMap& map, double rotate_y_deg, const Pixels& normals) {
    constexpr double resolution = 1e-3;
    Pixels truth;
    truth.reserve(normals.size());
    for (const auto& n : normals) {
        auto pixel = reference::irradiance(map, rotate_y_deg, n, resolution);
        for (double& channel : pixel) channel /= std::numbers::pi;
        truth.push_back(pixel);
    }
    return truth;
}

double relative_rmse(const Pixels& pixels, const Pixels& truth) {
    double square = 0;
    double mean = 0;
    for (std::size_t p = 0; p < truth.size(); ++p) {
        for (std::size_t c = 0; c < 3; ++c) {
            const double difference = pixels[p][c] - truth[p][c];
            square += difference * difference;
            mean += truth[p][c];
        }
    }
    const auto count = static_cast<double>(3 * truth.size());
    return std::sqrt(square / count) / (mean / count);
}

}  // namespace clerestory::test
