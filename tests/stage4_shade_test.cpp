#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "lit_map.hpp"
#include "maps.hpp"
#include "reference/sequence.hpp"
#include "reference/shade.hpp"
#include "reference/tables.hpp"
#include "shading/pixels.hpp"
#include "shading/shared.hpp"
#include "shading/stage4_per_pixel.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

using namespace test;
using reference::Light;
using reference::Vector;

// Relative RMSE against double. The worst case is a single sun low over the picture's horizon: a direction that is off
// by 6.5e-7 (tests/stage3_sample_test.cpp) over a mean cosine of 0.2, and a dozen roundings of 2^-24.
constexpr double SHADING_TOLERANCE = 6.5e-7 / 0.2 + 12 * 0x1p-24;
// Normals are rounded once from double.
constexpr double NORMAL_TOLERANCE = 0x1p-24;

/// Relative RMSE of an estimator's planes, over pixels and channels together and over the reference's mean.
double relative_rmse(const SphereView& view, const std::vector<float>& unit_albedo_radiance,
                     const std::vector<Vector>& exact) {
    long double squares = 0;
    long double sum = 0;
    for (std::size_t at = 0; at < view.count; ++at) {
        for (std::size_t c = 0; c < 3; ++c) {
            const long double error =
                static_cast<long double>(unit_albedo_radiance[c * view.stride + at]) - exact[at][c];
            squares += error * error;
            sum += exact[at][c];
        }
    }
    const auto count = static_cast<long double>(3 * view.count);
    return static_cast<double>(std::sqrt(squares / count) / (sum / count));
}

Vector normal_of(const std::vector<float>& normals, std::size_t stride, std::size_t at) {
    return {normals[at], normals[stride + at], normals[2 * stride + at]};
}

/// Radiance of a texel in the scale that kernels work in.
Vector scaled_radiance(const LitMap& lit, std::size_t texel) {
    Vector radiance{};
    for (std::size_t c = 0; c < 3; ++c) {
        radiance[c] = std::ldexp(static_cast<long double>(lit.map.rgb[3 * texel + c]), -lit.distribution.exponent);
    }
    return radiance;
}

/// What the random sequence's samples 0 .. count - 1 of a stream are as lights, from the fractions on.
std::vector<Light> lights_of_stream(const LitMap& lit, std::uint64_t seed, cl_uint domain, cl_uint stream,
                                    std::size_t count, long double rotation = 0) {
    std::vector<Light> lights;
    for (std::size_t k = 0; k < count; ++k) {
        const auto words = reference::philox4x32_10({static_cast<cl_uint>(k / 2), stream, domain, SEQUENCE_RANDOM},
                                                    {static_cast<cl_uint>(seed), static_cast<cl_uint>(seed >> 32)});
        const std::size_t half = 2 * (k % 2);
        const reference::Drawn drawn = reference::draw(lit.tables(), words.at(half), words.at(half + 1));
        const long double phi = 2 * std::numbers::pi_v<long double> *
                                (static_cast<long double>(drawn.column) + drawn.along) /
                                static_cast<long double>(lit.map.width);
        const Vector direction =
            reference::direction(reference::theta_in_row(drawn.row, lit.map.height, drawn.down), phi, rotation);
        lights.push_back(reference::light_of_sample(
            direction, scaled_radiance(lit, drawn.row * lit.map.width + drawn.column), drawn.pdf, count));
    }
    return lights;
}

/// Maps at both ends of float32's range and of contrast.
std::vector<NamedMap> shading_maps() {
    std::vector<NamedMap> maps;
    for (NamedMap& hard : hard_maps()) {
        for (const char* name :
             {"Random257x89", "Denormal", "LeastDenormal", "Largest", "LargestHalf", "LoneTopLeft", "LoneCentre",
              "Constant1x1", "Random3x2", "Suns1e12AtEnd", "LargestOverDenormal", "RandomDenormal"}) {
            if (hard.name == name) maps.push_back(std::move(hard));
        }
    }
    return maps;
}

class Stage4Shade : public testing::Test {
  protected:
    TestDevice device_;
};

TEST_F(Stage4Shade, ViewHoldsTheDiscsPixelsAndTheirNormals) {
    for (const std::size_t size : {1U, 2U, 3U, 33U, 511U}) {
        const SphereView view(device_, size);
        const auto wanted = reference::sphere_pixels(size);
        ASSERT_EQ(view.count, wanted.size()) << size;
        std::map<std::size_t, Vector> normal_at;
        for (const auto& pixel : wanted) normal_at[pixel.index] = pixel.normal;
        EXPECT_EQ(view.stride % SphereView::GROUP_PIXELS, 0U);
        EXPECT_GE(view.stride, view.count);
        const auto pixels = view.pixel.download();
        const auto normals = view.normal.download();
        for (std::size_t at = 0; at < view.count; ++at) {
            const auto found = normal_at.extract(pixels[at]);
            ASSERT_FALSE(found.empty()) << size << ": pixel " << pixels[at] << " is beside the disc, or there twice";
            const Vector normal = normal_of(normals, view.stride, at);
            for (std::size_t c = 0; c < 3; ++c) {
                ASSERT_NEAR(static_cast<double>(normal[c]), static_cast<double>(found.mapped()[c]), NORMAL_TOLERANCE);
            }
        }
        for (std::size_t at = view.count; at < view.stride; ++at) {
            ASSERT_EQ(normal_of(normals, view.stride, at), (Vector{0, 0, 1})) << size;
        }
    }
}

TEST_F(Stage4Shade, SharedSamplesAddUpAsInDouble) {
    const SphereView view(device_, 33);
    const auto normals = view.normal.download();
    SharedShader shader(device_);
    auto unit_albedo_radiance = view.planes(device_);
    double worst = 0;
    for (const NamedMap& hard : shading_maps()) {
        SamplingOptions options;
        options.seed = 9;
        LitMap lit(device_, hard.make(), options);
        for (const std::size_t count : {1U, 2U, 1001U}) {
            shader.shade(lit.sampler, lit.distribution, view, count, unit_albedo_radiance);
            const auto lights = lights_of_stream(lit, options.seed, DOMAIN_SHARED, 0, count);
            std::vector<Vector> exact;
            for (std::size_t at = 0; at < view.count; ++at) {
                exact.push_back(reference::shade(normal_of(normals, view.stride, at), lights));
            }
            const double error = relative_rmse(view, unit_albedo_radiance.download(), exact);
            EXPECT_LE(error, SHADING_TOLERANCE) << hard.name << ", " << count << " samples";
            worst = std::max(worst, error);
        }
    }
    RecordProperty("worst", std::to_string(worst * 1e7) + "e-7");
}

TEST_F(Stage4Shade, EachPixelsOwnSamplesAddUpAsInDouble) {
    const SphereView view(device_, 9);
    const auto normals = view.normal.download();
    const auto pixels = view.pixel.download();
    auto unit_albedo_radiance = view.planes(device_);
    double worst = 0;
    for (const NamedMap& hard : shading_maps()) {
        SamplingOptions options;
        options.seed = 0x9ABCDEF01234567;
        options.rotate_y_deg = 250;
        const long double rotation = 250 * std::numbers::pi_v<long double> / 180;
        LitMap lit(device_, hard.make(), options);
        PerPixelShader shader(device_, lit.on_device, lit.distribution, options);
        for (const std::size_t count : {1U, 2U, 33U}) {
            shader.shade(view, count, unit_albedo_radiance);
            std::vector<Vector> exact;
            for (std::size_t at = 0; at < view.count; ++at) {
                const auto lights = lights_of_stream(lit, options.seed, DOMAIN_PER_PIXEL, pixels[at], count, rotation);
                exact.push_back(reference::shade(normal_of(normals, view.stride, at), lights));
            }
            const double error = relative_rmse(view, unit_albedo_radiance.download(), exact);
            EXPECT_LE(error, SHADING_TOLERANCE) << hard.name << ", " << count << " samples";
            worst = std::max(worst, error);
        }
    }
    RecordProperty("worst", std::to_string(worst * 1e7) + "e-7");
}

/// A set that comes in several batches, the last one odd, adds up as one: a constant map's sphere is constant.
TEST_F(Stage4Shade, BatchesAddUp) {
    constexpr std::size_t COUNT = (std::size_t{1} << 20) + 4099;
    const SphereView view(device_, 5);
    LitMap lit(device_, constant_map(64, 32, 1));
    SharedShader shader(device_);
    auto unit_albedo_radiance = view.planes(device_);
    shader.shade(lit.sampler, lit.distribution, view, COUNT, unit_albedo_radiance);
    const auto values = unit_albedo_radiance.download();
    // A sample's cosine over its density has the mean 1 and, by integration, the variance 5/3; five sigmas.
    const double tolerance = 5 * std::sqrt(5.0 / 3 / static_cast<double>(COUNT));
    for (std::size_t at = 0; at < view.count; ++at) {
        EXPECT_NEAR(std::ldexp(static_cast<double>(values[at]), lit.distribution.exponent), 1, tolerance);
    }
}

/// The contract's hard case: 16 suns of 1e6 in a sky of 0.05. Where they do not reach, the sky's light must remain, and
/// it comes from draws that a float32 table cannot make.
TEST_F(Stage4Shade, SurfacesFacingAwayFromSunsGetTheSkysLight) {
    constexpr std::size_t COUNT = std::size_t{1} << 20;
    constexpr float SKY = 0.05F;
    SamplingOptions options;
    options.place = TexelPlace::centre;  // then the estimator's expectation is a sum over the table
    LitMap lit(device_, sun_map(1024, 512, 256, 16, 1e6F, SKY, true), options);
    const SphereView view(device_, 9);
    const auto normals = view.normal.download();
    SharedShader shader(device_);
    auto unit_albedo_radiance = view.planes(device_);
    shader.shade(lit.sampler, lit.distribution, view, COUNT, unit_albedo_radiance);
    const auto values = unit_albedo_radiance.download();
    const auto probabilities = texel_probabilities(lit.distribution);

    std::vector<Light> lights;
    for (std::size_t texel = 0; texel < probabilities.size(); ++texel) {
        ASSERT_GT(probabilities[texel], 0) << "texel " << texel << " cannot be drawn";
        const std::size_t row = texel / lit.map.width;
        const long double phi = 2 * std::numbers::pi_v<long double> *
                                (static_cast<long double>(texel % lit.map.width) + 0.5L) /
                                static_cast<long double>(lit.map.width);
        const Vector direction = reference::direction(reference::theta_in_row(row, lit.map.height, 0.5L), phi, 0);
        const long double pdf =
            static_cast<long double>(probabilities[texel]) / reference::solid_angle(row, lit.map.width, lit.map.height);
        lights.push_back(reference::light_of_sample(direction, scaled_radiance(lit, texel), pdf, 1));
    }
    std::size_t faced_away = 0;
    for (std::size_t at = 0; at < view.count; ++at) {
        const Vector normal = normal_of(normals, view.stride, at);
        if (normal[0] > -0.2L) continue;  // the suns lie around +x
        ++faced_away;
        long double mean = 0;
        long double squares = 0;
        for (std::size_t texel = 0; texel < probabilities.size(); ++texel) {
            const long double value = reference::shade(normal, {&lights[texel], 1})[0];
            mean += static_cast<long double>(probabilities[texel]) * value;
            squares += static_cast<long double>(probabilities[texel]) * value * value;
        }
        const auto deviation =
            static_cast<double>(std::sqrt((squares - mean * mean) / static_cast<long double>(COUNT)));
        // The integral of a constant sky over a half space is its radiance; texel centres stray by about 1e-5 at this
        // size.
        constexpr double CENTRES = 1e-4;
        EXPECT_NEAR(std::ldexp(static_cast<double>(mean), lit.distribution.exponent), SKY, SKY * CENTRES);
        EXPECT_LT(5 * deviation, static_cast<double>(mean) / 2) << "too few samples to tell the sky from nothing";
        EXPECT_NEAR(values[at], static_cast<double>(mean), 5 * deviation);
    }
    EXPECT_GT(faced_away, 0U);
}

TEST_F(Stage4Shade, ResultsAreTheSameForEveryWorkGroupAndThreadCount) {
    const auto shaded = [](const DeviceOptions& chosen, bool shared) {
        const TestDevice device(chosen);
        LitMap lit(device, random_map(257, 89, 7));
        const SphereView view(device, 33);
        auto unit_albedo_radiance = view.planes(device);
        if (shared) {
            SharedShader(device).shade(lit.sampler, lit.distribution, view, 100, unit_albedo_radiance);
        } else {
            PerPixelShader(device, lit.on_device, lit.distribution, {}).shade(view, 5, unit_albedo_radiance);
        }
        return unit_albedo_radiance.download();
    };
    for (const bool shared : {true, false}) {
        const auto wanted = shaded({}, shared);
        for (const std::size_t group : {1U, 3U, 64U}) {
            EXPECT_EQ(shaded(DeviceOptions{"", 0, group}, shared), wanted) << "groups of " << group;
        }
        EXPECT_EQ(shaded(DeviceOptions{"", 1, 0}, shared), wanted) << "one thread";
    }
}

}  // namespace
}  // namespace clerestory
