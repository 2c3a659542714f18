// Every kernel once, on inputs so small that oclgrind, which interprets them, gets through in a minute:
// scripts/check_oclgrind.sh runs this suite under it, and fails where a kernel of kernels/ has not run.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"
#include "fresnel/fresnel.hpp"
#include "maps.hpp"
#include "render/renderer.hpp"
#include "sampling/stage3_sample.hpp"
#include "shading/pixels.hpp"
#include "shading/stage4_shade.hpp"
#include "tables/stage2_cdf.hpp"
#include "tables/table_arithmetic.hpp"
#include "test_device.hpp"

namespace clerestory::test {
namespace {

constexpr std::size_t SIDE = 6;

class Tiny : public ::testing::Test {
  protected:
    TestDevice device_;
    TableBuilder builder_{device_};
    Renderer renderer_{device_};

    /// Renders, and holds the picture against no more than that it has light and no bad value.
    void render(const Scene& scene, Estimator estimator, const SamplingOptions& sampling) {
        RenderOptions options;
        options.estimator = estimator;
        options.samples = 3;
        options.size = SIDE;
        options.sampling = sampling;
        options.harmonic = {4, 128};
        const Rendered picture = renderer_.render(scene, options);
        double light = 0;
        for (std::size_t i = 0; i < picture.rgba.size(); ++i) {
            EXPECT_TRUE(std::isfinite(picture.rgba[i])) << estimator_name(estimator);
            if (i % 4 != 3) light += picture.rgba[i];
        }
        EXPECT_GT(light, 0) << estimator_name(estimator);
    }
};

TEST_F(Tiny, BothScanPathsBuildTheSameTables) {
    const RadianceMap map = ramp_map(37, 3);  // two wide registers, and five texels beside them
    const DeviceMap on_device(device_, map);
    const Distribution rows = builder_.build(on_device, {.path = ScanPath::rows});
    const Distribution chunks = builder_.build(on_device, {.path = ScanPath::chunks});
    EXPECT_EQ(rows.conditional.download(), chunks.conditional.download());
    EXPECT_EQ(rows.marginal.download(), chunks.marginal.download());
    EXPECT_EQ(rows.conditional_guide.download(), chunks.conditional_guide.download());
}

TEST_F(Tiny, SampledEstimatorsGiveFiniteLightByAnySequence) {
    const Scene scene(device_, builder_, ramp_map(5, 3));
    for (const Sequence sequence : {Sequence::random, Sequence::stratified, Sequence::sobol}) {
        for (const Estimator estimator : {Estimator::shared, Estimator::per_pixel}) {
            render(scene, estimator, {.sequence = sequence});
        }
    }
}

TEST_F(Tiny, ControlVariatesGiveFiniteLight) {
    const Scene scene(device_, builder_, ramp_map(5, 3));
    for (const Estimator estimator : {Estimator::shared, Estimator::per_pixel}) {
        render(scene, estimator, {.control_degree = 4});
    }
}

TEST_F(Tiny, LightsMeetGroupsAndPixelsAlike) {
    const SphereView view(device_, 5);
    const Scene scene(device_, builder_, ramp_map(5, 3));
    Sampler sampler(device_, scene.device_map(), scene.distribution(), {});
    LightBuffer lights(device_, 3);
    LightShader groups(device_);
    groups.weigh(sampler.draw(lights.count), std::ldexp(1.0F, -scene.distribution().exponent), 0.1F, lights);
    const auto shaded = [&](LightShader& shader) {
        Buffer<cl_float> unit_albedo_radiance = view.planes(device_);
        unit_albedo_radiance.fill(0.0F);
        shader.shade(view, lights, true, unit_albedo_radiance);
        return unit_albedo_radiance.download();
    };
    LightShader every_pair(device_, true);
    const auto by_group = shaded(groups);
    const auto by_pixel = shaded(every_pair);
    const float largest = *std::max_element(by_pixel.begin(), by_pixel.end());
    EXPECT_GT(largest, 0);
    for (std::size_t at = 0; at < view.count; ++at) {
        EXPECT_NEAR(by_group[at], by_pixel[at], 1e-6F * largest);  // as in tests/lights_test.cpp
    }
}

TEST_F(Tiny, ExactLightIsFinite) {
    const Scene scene(device_, builder_, ramp_map(5, 3));
    render(scene, Estimator::exact, {.rotate_y_deg = 40});
}

/// On a map of this size a texel is 64 lights: the sun fits.
TEST_F(Tiny, HarmonicsAndDirectLightsGiveFiniteLight) {
    const Scene scene(device_, builder_, sun_map(64, 32, 10, 1, 1000.0F, 1.0F, true));
    render(scene, Estimator::harmonic, {.rotate_y_deg = 40});
}

TEST_F(Tiny, PlainSearchesDrawCentres) {
    const RadianceMap map = ramp_map(5, 3);
    const DeviceMap on_device(device_, map);
    const Distribution distribution = builder_.build(on_device);
    Sampler sampler(device_, on_device, distribution, {.place = TexelPlace::centre}, Search::plain);
    for (const float pdf : sampler.draw(3).pdf.download()) EXPECT_GT(pdf, 0);
}

TEST_F(Tiny, PointsAreLocatedInsideTheTable) {
    const RadianceMap map = ramp_map(5, 3);
    const DeviceMap on_device(device_, map);
    const Distribution distribution = builder_.build(on_device);
    Sampler sampler(device_, on_device, distribution, {});
    const std::vector<cl_uint> points = {0, 0, ~0U, ~0U, 1U << 31, 1U << 30};
    for (const cl_uint texel : sampler.locate(points).texel) EXPECT_LT(texel, 15U);
}

TEST_F(Tiny, MarksArePreviewedOnTheMap) {
    const RadianceMap map = ramp_map(5, 3);
    const Scene scene(device_, builder_, ramp_map(5, 3));
    Sampler sampler(device_, scene.device_map(), scene.distribution(), {});
    const SampleSet set = sampler.draw(2);
    const auto preview = renderer_.display().marked_preview(map, 1, {}, set.texel);
    EXPECT_EQ(preview.size(), 15U);
    EXPECT_EQ(preview[set.texel.download()[0]], 0xFF00FF00U);
}

TEST_F(Tiny, EveryTableArithmeticDrawsEveryTexelOfARamp) {
    const RadianceMap map = ramp_map(5, 3);
    const DeviceMap on_device(device_, map);
    for (const TableArithmetic arithmetic : TABLE_ARITHMETICS) {
        const ArithmeticReport report = measure_table_arithmetic(device_, on_device, Luminance::average, arithmetic);
        EXPECT_EQ(report.lit, 15U) << name_of(arithmetic);
        EXPECT_EQ(report.undrawable, 0U) << name_of(arithmetic);
    }
}

TEST_F(Tiny, BothFresnelArithmeticsReflectTheSame) {
    const Media glass;
    const std::vector<double> angles = {0, 30, 56.25, 90};
    const FresnelCurves pairs = fresnel_curves(device_, glass, angles, FresnelArithmetic::float_pairs);
    const FresnelCurves fp64 = fresnel_curves(device_, glass, angles, FresnelArithmetic::fp64);
    for (std::size_t i = 0; i < angles.size(); ++i) {
        EXPECT_FLOAT_EQ(pairs.mean[i], fp64.mean[i]) << angles[i];
        EXPECT_FLOAT_EQ(pairs.schlick[i], fp64.schlick[i]) << angles[i];
    }
}

/// Every kernel that only devices with work-items in lock step run. The map is higher than a tile of the marginal.
TEST_F(Tiny, WorkItemsInLockStepBuildTheSameTablesAndGiveFiniteLight) {
    const Device in_step({.act_as = ActAs::accelerator});
    ASSERT_FALSE(in_step.traits().fat_items);
    TableBuilder builder(in_step);
    const RadianceMap map = ramp_map(3, in_step.traits().scan_lanes + 1);
    const Distribution groups = builder.build(DeviceMap(in_step, map));
    const Distribution chunks = builder_.build(DeviceMap(device_, map), {.path = ScanPath::chunks});
    EXPECT_EQ(groups.conditional.download(), chunks.conditional.download());
    EXPECT_EQ(groups.marginal.download(), chunks.marginal.download());
    const Scene sun(in_step, builder, sun_map(64, 32, 10, 1, 1000.0F, 1.0F, true));
    Renderer renderer(in_step);
    for (const Estimator estimator : {Estimator::harmonic, Estimator::exact, Estimator::shared}) {
        RenderOptions options;
        options.estimator = estimator;
        options.samples = 3;
        options.size = SIDE;
        options.harmonic = {4, 128};
        double light = 0;
        for (const float value : renderer.render(sun, options).rgba) {
            EXPECT_TRUE(std::isfinite(value)) << estimator_name(estimator);
            light += value;
        }
        EXPECT_GT(light, 0) << estimator_name(estimator);
    }
}

/// Four points of either sequence are an elementary stratification: one a quarter of the square.
TEST_F(Tiny, FourStratifiedPointsLieInFourQuarters) {
    for (const Sequence sequence : {Sequence::stratified, Sequence::sobol}) {
        const Program program(device_, "sequence.cl", fmt::format("-DSEQUENCE={}u", static_cast<cl_uint>(sequence)));
        Kernel<cl_uint, cl_uint, cl_uint, cl_uint, Strata, cl_uint, cl_uint, Buffer<cl_uint>> write_points(
            device_, program, "write_points");
        Buffer<cl_uint> point(device_, "the points", 8);
        write_points({2, 4}, 1U, 0U, static_cast<cl_uint>(DOMAIN_SHARED), 0U, strata(4), 0U, 2U, point);
        const std::vector<cl_uint> fractions = point.download();
        std::set<std::pair<cl_uint, cl_uint>> quarters;
        for (std::size_t i = 0; i < 4; ++i) quarters.emplace(fractions[2 * i] >> 31, fractions[2 * i + 1] >> 31);
        EXPECT_EQ(quarters.size(), 4U);
    }
}

}  // namespace
}  // namespace clerestory::test
