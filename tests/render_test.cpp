// Pictures of whole renders: against the exact estimator, closed forms, and themselves.
#include "render/renderer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "comparison.hpp"
#include "maps.hpp"
#include "test_device.hpp"

namespace clerestory::test {
namespace {

constexpr std::size_t SIDE = 31;
constexpr int SEEDS = 64;
// A mean over 64 seeds strays by more than 4 of its standard errors once in 16,000 values; the seeds are fixed, so a
// failure is a defect and not bad luck.
constexpr double STANDARD_ERRORS = 4;
// The exact estimator's own bound, and what float32 sums of a few hundred samples add to a constant map's.
constexpr double EXACT_BOUND = 2e-6;

class Render : public ::testing::Test {
  protected:
    TestDevice device_;
    TableBuilder builder_{device_};
    Renderer renderer_{device_};

    RenderOptions options(Estimator estimator, std::size_t samples, std::uint64_t seed = 1) const {
        RenderOptions options;
        options.estimator = estimator;
        options.samples = samples;
        options.size = SIDE;
        options.sampling.seed = seed;
        return options;
    }

    std::vector<float> pixels(const Scene& scene, const RenderOptions& chosen) {
        return renderer_.render(scene, chosen).rgba;
    }
};

/// Means and standard errors over seeds of each value of a picture, and the error's mean square.
struct SeedStatistics {
    std::vector<double> mean;
    std::vector<double> standard_error;
    double rmse = 0;
};

SeedStatistics over_seeds(const std::vector<std::vector<float>>& pictures, const std::vector<float>& exact) {
    const auto n = static_cast<double>(pictures.size());
    SeedStatistics statistics;
    double squares = 0;
    double lit = 0;
    for (std::size_t i = 0; i < exact.size(); ++i) {
        double sum = 0;
        double sum_of_squares = 0;
        for (const auto& picture : pictures) {
            const double value = static_cast<double>(picture[i]);
            sum += value;
            sum_of_squares += value * value;
            squares += (value - static_cast<double>(exact[i])) * (value - static_cast<double>(exact[i]));
        }
        lit += exact[i] > 0 ? n : 0;
        statistics.mean.push_back(sum / n);
        const double variance = std::max(0.0, sum_of_squares / n - sum * sum / (n * n)) * n / (n - 1);
        statistics.standard_error.push_back(std::sqrt(variance / n));
    }
    statistics.rmse = std::sqrt(squares / lit);
    return statistics;
}

struct StatisticsCase {
    Estimator estimator;
    std::vector<std::size_t> counts;
    std::string name;
};

class RenderStatistics : public Render, public ::testing::WithParamInterface<StatisticsCase> {};

TEST_P(RenderStatistics, MeansOverSeedsMeetTheExactPictureAndErrorsFallAsOneOverRootN) {
    const Scene scene(device_, builder_, std::move(bundled_maps().at(1).second));
    const std::vector<float> exact = pixels(scene, options(Estimator::exact, 1));
    std::vector<double> rmse;
    for (const std::size_t count : GetParam().counts) {
        std::vector<std::vector<float>> pictures;
        for (int seed = 1; seed <= SEEDS; ++seed) {
            pictures.push_back(pixels(scene, options(GetParam().estimator, count, static_cast<std::uint64_t>(seed))));
        }
        const SeedStatistics statistics = over_seeds(pictures, exact);
        for (std::size_t probe = 0; probe < 16; ++probe) {
            // Probes along both diagonals of the disc's inner square.
            const std::size_t row = SIDE / 4 + probe % 8 * 2;
            const std::size_t column = probe < 8 ? row : SIDE - 1 - row;
            const std::size_t at = 4 * (row * SIDE + column);
            EXPECT_NEAR(statistics.mean[at], exact[at], STANDARD_ERRORS * statistics.standard_error[at])
                << count << " samples, pixel " << row << ", " << column;
        }
        rmse.push_back(statistics.rmse);
    }
    // Shared sets have one error per seed for the whole picture: the rms of 64 of them is itself known to about 9 %
    // (1 / sqrt(2 * 64)); per-pixel errors average over the picture as well.
    const double tolerance = GetParam().estimator == Estimator::shared ? 0.3 : 0.05;
    for (std::size_t i = 1; i < rmse.size(); ++i) {
        const double expected =
            std::sqrt(static_cast<double>(GetParam().counts[i]) / static_cast<double>(GetParam().counts[i - 1]));
        EXPECT_NEAR(rmse[i - 1] / rmse[i] / expected, 1, tolerance) << GetParam().counts[i];
    }
}

INSTANTIATE_TEST_SUITE_P(Estimators, RenderStatistics,
                         ::testing::Values(StatisticsCase{Estimator::shared, {64, 256, 1024}, "Shared"},
                                           StatisticsCase{Estimator::per_pixel, {8, 16, 32}, "PerPixel"}),
                         [](const auto& info) { return info.param.name; });

TEST_F(Render, AConstantMapGivesItsRadianceTimesTheAlbedoEverywhere) {
    for (const auto& [width, height] :
         std::vector<std::pair<std::size_t, std::size_t>>{{1, 1}, {2, 1}, {1, 4}, {3, 2}, {17, 9}, {64, 32}}) {
        const Scene scene(device_, builder_, constant_map(width, height, 3));
        RenderOptions chosen = options(Estimator::exact, 1);
        chosen.albedo = 0.5;
        chosen.scale = 2;
        const Rendered picture = renderer_.render(scene, chosen);
        for (std::size_t i = 0; i < SIDE * SIDE; ++i) {
            if (picture.rgba[4 * i + 3] == 0) continue;
            EXPECT_NEAR(picture.rgba[4 * i + 1], 3, 3 * EXACT_BOUND) << width << "x" << height << ", pixel " << i;
        }
    }
}

TEST_F(Render, PixelsBesideTheSphereAreBlackAndTransparent) {
    const Scene scene(device_, builder_, constant_map(4, 2, 1));
    const std::vector<float> picture = pixels(scene, options(Estimator::shared, 4));
    std::size_t on_sphere = 0;
    for (std::size_t py = 0; py < SIDE; ++py) {
        for (std::size_t px = 0; px < SIDE; ++px) {
            const double x = 2 * (static_cast<double>(px) + 0.5) / SIDE - 1;
            const double y = 1 - 2 * (static_cast<double>(py) + 0.5) / SIDE;
            const float* pixel = &picture[4 * (py * SIDE + px)];
            const bool on = x * x + y * y < 1;
            EXPECT_EQ(pixel[3], on ? 1 : 0);
            on_sphere += on ? 1 : 0;
            if (!on) {
                EXPECT_EQ(pixel[0] + pixel[1] + pixel[2], 0);
            }
        }
    }
    EXPECT_GT(on_sphere, 0U);
}

TEST_F(Render, ABlackMapGivesABlackSphereByEveryEstimator) {
    const Scene scene(device_, builder_, constant_map(4, 2, 0));
    for (const std::string& name : estimator_names()) {
        const std::vector<float> picture = pixels(scene, options(estimator_by_name(name), 4));
        for (std::size_t i = 0; i < SIDE * SIDE; ++i) {
            EXPECT_EQ(picture[4 * i] + picture[4 * i + 1] + picture[4 * i + 2], 0) << name;
        }
    }
}

TEST_F(Render, LightFromAboveFallsOnTheUpperPixels) {
    const Scene scene(device_, builder_, lone_texel_map(8, 8, 0, 3));
    for (const std::string& name : estimator_names()) {
        const std::vector<float> picture = pixels(scene, options(estimator_by_name(name), 16));
        const float top = picture[4 * (2 * SIDE + SIDE / 2)];
        EXPECT_GT(top, 0) << name;
        // Harmonics leave a truncation error below 1e-3 of the lit side; every other estimator leaves nothing.
        const float bound = estimator_by_name(name) == Estimator::harmonic ? 1e-3F * top : 0.0F;
        EXPECT_LE(picture[4 * ((SIDE - 3) * SIDE + SIDE / 2)], bound) << name;
    }
}

TEST_F(Render, ARotationByAQuarterTurnLightsTheFarSideWithTheCentreColumn) {
    // Column 4 of 8 begins at phi = pi; turned by 90 degrees, columns 3 and 4 lie about -z, behind the sphere.
    const Scene scene(device_, builder_,
                      make_map(8, 4, [](std::size_t row, std::size_t column) -> std::array<float, 3> {
                          const bool lit = (row == 1 || row == 2) && (column == 3 || column == 4);
                          return {lit ? 1.0F : 0.0F, 0, 0};
                      }));
    const std::size_t centre = 4 * (SIDE / 2 * SIDE + SIDE / 2);
    for (const std::string& name : estimator_names()) {
        RenderOptions chosen = options(estimator_by_name(name), 64);
        chosen.sampling.rotate_y_deg = 90;
        // Sampled cosines are clamped to 0; the exact sum of edges leaves rounding of the double sums.
        EXPECT_NEAR(pixels(scene, chosen)[centre], 0, 1e-14) << name;
        chosen.sampling.rotate_y_deg = -90;
        EXPECT_GT(pixels(scene, chosen)[centre], 0) << name;
    }
}

TEST_F(Render, TheSameSeedGivesTheSameBitsForAnyThreadsAndGroups) {
    const auto render_with = [&](const DeviceOptions& device_options, Estimator estimator) {
        const TestDevice device(device_options);
        TableBuilder builder(device);
        const Scene scene(device, builder, ramp_map(31, 17));
        Renderer renderer(device);
        RenderOptions chosen = options(estimator, 9, 7);
        return renderer.render(scene, chosen).rgba;
    };
    for (const std::string& name : estimator_names()) {
        const Estimator estimator = estimator_by_name(name);
        const auto expected = render_with({}, estimator);
        EXPECT_EQ(render_with({}, estimator), expected) << name;
        EXPECT_EQ(render_with({.selector = "", .threads = threads_where_possible(1), .work_group = 0}, estimator),
                  expected)
            << name;
        EXPECT_EQ(render_with({.selector = "", .threads = 0, .work_group = 3}, estimator), expected) << name;
    }
}

TEST_F(Render, DimAndBrightMapsStayInsideFloat32) {
    for (const float value : {1e-40F, 1e-30F, 1e30F, 3e38F}) {
        const Scene scene(device_, builder_, constant_map(4, 2, value));
        for (const std::string& name : estimator_names()) {
            const std::vector<float> picture = pixels(scene, options(estimator_by_name(name), 4096));
            const float centre = picture[4 * (SIDE / 2 * SIDE + SIDE / 2)];
            // 4096 uniform directions know the furnace's constant to 1.4 %; 10 % is seven of these.
            EXPECT_NEAR(centre / value, 1, 0.1) << name << " of " << value;
        }
    }
}

}  // namespace
}  // namespace clerestory::test
