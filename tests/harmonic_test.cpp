#include "shading/harmonic.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "lit_sphere.hpp"
#include "maps.hpp"
#include "reference/harmonic.hpp"
#include "shading/legendre.hpp"
#include "shading/pixels.hpp"

namespace clerestory {
namespace {

using test::Lit;
using test::normals_of;
using test::pixels_of;
using test::quadrature;
using test::relative_rmse;

constexpr double pi = std::numbers::pi;

/// Sums of float32 products over columns round to 2^-24 a step; errors of many steps add up like a random walk, and
/// coefficients are sums over rows on top: a few units in 2^-23 of the map's root mean square.
constexpr double PROJECTION_TOLERANCE = 1e-6;
/// The device's recurrences and its sums of up to 861 terms in float32, against the series' mean.
constexpr double EVALUATION_TOLERANCE = 2e-6;
/// Gauss-Legendre over whole rows against many short panels, both in double.
constexpr double INTEGRAL_TOLERANCE = 1e-13;
/// The contract's limit for the estimator's defaults on photographed maps.
constexpr double DEFAULTS_RMSE = 1e-3;

TEST(Harmonic, LambertFactorsAreTheClampedCosinesMoments) {
    const std::vector<double> factors = lambert_factors(40);
    for (unsigned l = 0; l <= 40; ++l) EXPECT_NEAR(factors[l], 2 * reference::clamped_cosine_moment(l), 1e-12) << l;
}

TEST(Harmonic, SeriesInTheDoubledAngleIsTheClampedCosinesLegendreSeries) {
    for (const unsigned degree : {1U, 2U, 7U, 8U, 20U}) {
        const std::vector<double> series = clamped_cosine_series(degree);
        for (double x = -1; x <= 1; x += 0.0625) {
            double sum = 0;
            for (std::size_t k = series.size(); k-- > 0;) sum = sum * (2 * x * x - 1) + series[k];
            EXPECT_NEAR(sum + x / 2, reference::clamped_cosine_cut(degree, x), 1e-11) << degree << " " << x;
        }
    }
}

TEST(Harmonic, RowIntegralsAreExactForRowsOfAnyHeight) {
    constexpr unsigned degree = 40;
    for (const std::size_t height : {1U, 2U, 3U, 64U}) {
        const std::vector<double> rows = legendre_row_integrals(height, degree);
        for (unsigned l = 0; l <= degree; l += l < 2 ? 1 : 2) {
            for (unsigned m = 0; m <= l; m += 3) {
                for (const std::size_t row : {std::size_t{0}, height / 2, height - 1}) {
                    EXPECT_NEAR(rows[row * triangle_size(degree) + triangle_index(l, m)],
                                reference::legendre_row_integral(l, m, row, height), INTEGRAL_TOLERANCE)
                        << l << " " << m << " row " << row << " of " << height;
                }
            }
        }
    }
}

struct Size {
    std::size_t width;
    std::size_t height;
};

class HarmonicProjection : public testing::TestWithParam<Size> {};

TEST_P(HarmonicProjection, AgreesWithTheDoubleReference) {
    constexpr unsigned degree = 20;
    Lit lit(test::random_map(GetParam().width, GetParam().height, 7));
    const ProjectedMap light = lit.shader.project(lit.on_device, lit.distribution, {degree, 0});
    const auto expected = reference::harmonic_coefficients(lit.map, degree);
    double energy = 0;
    for (const auto& e : expected) {
        for (const double x : e) energy += x * x;
    }
    for (unsigned l = 0; l <= degree; l += l < 2 ? 1 : 2) {
        for (unsigned m = 0; m <= l; ++m) {
            for (std::size_t k = 0; k < 6; ++k) {
                const std::size_t at = triangle_index(l, m);
                EXPECT_NEAR(lit.unscaled(light.coefficients[at][k]), expected[at][k],
                            PROJECTION_TOLERANCE * std::sqrt(energy))
                    << "l " << l << " m " << m << " part " << k;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Sizes, HarmonicProjection,
                         testing::Values(Size{1, 1}, Size{1, 7}, Size{7, 1}, Size{3, 2}, Size{64, 32}, Size{257, 89},
                                         Size{1030, 6}),
                         [](const auto& size) {
                             return std::to_string(size.param.width) + "x" + std::to_string(size.param.height);
                         });

TEST(Harmonic, SeriesIsEvaluatedToRoundingAtEveryDegreeAndRotation) {
    Lit lit(test::random_map(16, 8, 3));
    const SphereView view(lit.device, 31);
    Buffer<cl_float> unit_albedo_radiance = view.planes(lit.device);
    for (const unsigned degree : {0U, 1U, 2U, 7U, 8U, 30U, 40U}) {
        const ProjectedMap light = lit.shader.project(lit.on_device, lit.distribution, {degree, 0});
        for (const double rotation : {0.0, 90.0, -37.5}) {
            lit.shader.shade_series(light, rotation, view, unit_albedo_radiance);
            auto expected =
                reference::harmonic_irradiance(light.coefficients, degree, rotation * pi / 180, normals_of(view));
            for (auto& pixel : expected) {
                for (double& channel : pixel) channel = lit.unscaled(channel);
            }
            EXPECT_LT(relative_rmse(pixels_of(lit, view, unit_albedo_radiance), expected), EVALUATION_TOLERANCE)
                << "degree " << degree << " rotation " << rotation;
        }
    }
}

TEST(Harmonic, ConstantMapGivesItsOwnRadianceWhateverTheScale) {
    for (const float value : {1e-40F, 0.7F, 3e38F}) {
        Lit lit(test::constant_map(8, 4, value));
        const SphereView view(lit.device, 15);
        Buffer<cl_float> unit_albedo_radiance = view.planes(lit.device);
        const ProjectedMap light = lit.shader.project(lit.on_device, lit.distribution);
        lit.shader.shade(light, 10, view, unit_albedo_radiance);
        for (const auto& pixel : pixels_of(lit, view, unit_albedo_radiance)) {
            for (const double channel : pixel) {
                EXPECT_NEAR(channel / static_cast<double>(value), 1, 2 * EVALUATION_TOLERANCE);
            }
        }
        EXPECT_LT(light.truncation_estimate, 1e-6);
    }
}

TEST(Harmonic, BlackMapGivesABlackSphere) {
    Lit lit(test::constant_map(8, 4, 0));
    const SphereView view(lit.device, 15);
    Buffer<cl_float> unit_albedo_radiance = view.planes(lit.device);
    const ProjectedMap light = lit.shader.project(lit.on_device, lit.distribution);
    lit.shader.shade(light, 0, view, unit_albedo_radiance);
    EXPECT_THAT(unit_albedo_radiance.download(), testing::Each(0.0F));
    EXPECT_EQ(light.truncation_bound, 0);
}

TEST(Harmonic, LightsAreTheBrightestTexelsAndNoLightIsLost) {
    Lit lit(test::random_map(1024, 64, 11));
    const ProjectedMap whole = lit.shader.project(lit.on_device, lit.distribution, {8, 0});
    const ProjectedMap split = lit.shader.project(lit.on_device, lit.distribution, {8, 1000});
    EXPECT_TRUE(whole.lights.empty());
    // Texels of this map are longer in theta than a light may be: each becomes four.
    EXPECT_GT(split.light_texels, 100U);
    EXPECT_LE(split.lights.size(), 1000U);
    EXPECT_EQ(split.lights.size(), 4 * split.light_texels);
    const auto intensity = [](const float* t) { return t[0] + t[1] + t[2]; };
    std::vector<float> all;
    for (std::size_t t = 0; t < lit.map.rgb.size(); t += 3) all.push_back(intensity(lit.map.rgb.data() + t));
    std::sort(all.begin(), all.end(), std::greater<>());
    // The lights' texels are the first of the sorted list: what they give up is all above one threshold.
    double excess = 0;
    const double threshold = static_cast<double>(all[split.light_texels]);
    for (std::size_t t = 0; t < split.light_texels; ++t) excess += static_cast<double>(all[t]) - threshold;
    double taken = 0;
    std::array<double, 3> flux{};
    for (const AreaTexel& light : split.lights) {
        for (std::size_t k = 0; k < 3; ++k) {
            const double radiance = lit.unscaled(static_cast<double>(light.radiance[k]));
            taken += radiance / 4;
            flux[k] += radiance * light.vector[1];
        }
    }
    EXPECT_LE(taken, excess);
    EXPECT_GT(taken, excess * 0.9);  // the threshold is an edge of a bin, up to 1/32 above the next texel
    // Degree 1 along +y of the lights and what remains adds up to that of the whole.
    for (std::size_t k = 0; k < 3; ++k) {
        const double y = std::sqrt(3 / (4 * pi));
        const double expected = lit.unscaled(whole.coefficients[triangle_index(1, 0)][k]);
        EXPECT_NEAR(lit.unscaled(split.coefficients[triangle_index(1, 0)][k]) + y * flux[k], expected,
                    PROJECTION_TOLERANCE * lit.unscaled(whole.coefficients[0][k]));
    }
}

TEST(Harmonic, TheSameMapGivesTheSameBits) {
    Lit lit(test::random_map(300, 70, 2));
    const SphereView view(lit.device, 31);
    Buffer<cl_float> first = view.planes(lit.device);
    Buffer<cl_float> second = view.planes(lit.device);
    lit.shader.shade(lit.shader.project(lit.on_device, lit.distribution), 20, view, first);
    lit.shader.shade(lit.shader.project(lit.on_device, lit.distribution), 20, view, second);
    EXPECT_EQ(first.download(), second.download());
}

TEST(Harmonic, NoPixelIsNegativeWhereTheCutSeriesIs) {
    Lit lit(test::lone_texel_map(64, 32, 3, 5, 1e12F));
    const SphereView view(lit.device, 63);
    Buffer<cl_float> unit_albedo_radiance = view.planes(lit.device);
    const ProjectedMap light = lit.shader.project(lit.on_device, lit.distribution, {20, 0});
    lit.shader.shade_series(light, 0, view, unit_albedo_radiance);
    const std::vector<float> series = unit_albedo_radiance.download();
    EXPECT_LT(*std::min_element(series.begin(), series.end()), 0);
    lit.shader.shade(light, 0, view, unit_albedo_radiance);
    const std::vector<float> shaded = unit_albedo_radiance.download();
    EXPECT_GE(*std::min_element(shaded.begin(), shaded.end()), 0);
}

TEST(Harmonic, ASunOverADimSkyIsRightOnBothSides) {
    Lit lit(test::sun_map(128, 64, 20, 1, 1e9F, 0.05F, false));
    const SphereView view(lit.device, 31);
    Buffer<cl_float> unit_albedo_radiance = view.planes(lit.device);
    const double rotation = 90;
    lit.shader.shade(lit.shader.project(lit.on_device, lit.distribution), rotation, view, unit_albedo_radiance);
    const auto truth = quadrature(lit.map, rotation, normals_of(view));
    // Lights of side 2 pi / 512 count as points: 3e-4 where one stands alone (harmonic.cpp), the quadrature's cells
    // too.
    EXPECT_LT(relative_rmse(pixels_of(lit, view, unit_albedo_radiance), truth), 1e-3);
    const auto pixels = pixels_of(lit, view, unit_albedo_radiance);
    // Facing away from the sun there is only the sky, which float32 sums over the map must not lose.
    std::size_t facing_away = 0;
    for (std::size_t p = 0; p < truth.size(); ++p) {
        if (truth[p][0] > 0.0501) continue;
        EXPECT_NEAR(pixels[p][0], 0.05, 0.05 * 1e-5);
        ++facing_away;
    }
    EXPECT_GT(facing_away, 20U);
}

TEST(Harmonic, DefaultsReachTheContractsErrorOnPhotographedMaps) {
    for (auto& [name, map] : test::bundled_maps()) {
        Lit lit(std::move(map));
        const SphereView view(lit.device, 11);
        Buffer<cl_float> unit_albedo_radiance = view.planes(lit.device);
        const ProjectedMap light = lit.shader.project(lit.on_device, lit.distribution);
        lit.shader.shade(light, 0, view, unit_albedo_radiance);
        const double error =
            relative_rmse(pixels_of(lit, view, unit_albedo_radiance), quadrature(lit.map, 0, normals_of(view)));
        EXPECT_LT(error, DEFAULTS_RMSE) << name;
        EXPECT_LT(error, light.truncation_bound + 1e-5) << name;
        EXPECT_LT(error, 3 * light.truncation_estimate + 1e-5) << name;
        EXPECT_GT(error, light.truncation_estimate / 5) << name;
    }
}

TEST(Harmonic, OptionsOutOfRangeAreRefused) {
    Lit lit(test::constant_map(2, 1, 1));
    EXPECT_THROW(lit.shader.project(lit.on_device, lit.distribution, {HarmonicOptions::MAX_DEGREE + 1, 0}), UsageError);
    EXPECT_THROW(lit.shader.project(lit.on_device, lit.distribution, {8, HarmonicOptions::MAX_LIGHTS + 1}), UsageError);
}

}  // namespace
}  // namespace clerestory
