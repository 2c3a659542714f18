// Every kernel once, on inputs so small that oclgrind, which interprets them, gets through in a minute:
// scripts/check_oclgrind.sh runs this suite under it.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "comparison.hpp"
#include "fresnel.hpp"
#include "maps.hpp"
#include "render.hpp"
#include "table_arithmetic.hpp"

namespace clerestory::test {
namespace {

constexpr std::size_t SIDE = 6;

class Tiny : public ::testing::Test {
  protected:
    Device device_;
    TableBuilder builder_{device_};
    Renderer renderer_{device_};

    Rendered render(const Scene& scene, Estimator estimator, std::size_t samples, Sequence sequence) {
        RenderOptions options;
        options.estimator = estimator;
        options.samples = samples;
        options.size = SIDE;
        options.sampling.sequence = sequence;
        return renderer_.render(scene, options);
    }
};

TEST_F(Tiny, BothScanPathsBuildTheSameTables) {
    const RadianceMap map = ramp_map(5, 3);
    const DeviceMap on_device(device_, map);
    const Distribution rows = builder_.build(on_device, {.path = ScanPath::rows});
    const Distribution chunks = builder_.build(on_device, {.path = ScanPath::chunks});
    EXPECT_EQ(rows.conditional.download(), chunks.conditional.download());
    EXPECT_EQ(rows.marginal.download(), chunks.marginal.download());
}

TEST_F(Tiny, EstimatorsAndSequencesGiveFiniteLight) {
    const Scene scene(device_, builder_, ramp_map(5, 3));
    for (const Estimator estimator : {Estimator::shared, Estimator::per_pixel, Estimator::exact}) {
        for (const Sequence sequence : {Sequence::random, Sequence::stratified, Sequence::sobol}) {
            const Rendered picture = render(scene, estimator, 3, sequence);
            const double sum = std::accumulate(picture.rgba.begin(), picture.rgba.end(), 0.0);
            EXPECT_TRUE(std::isfinite(sum)) << estimator_name(estimator);
            EXPECT_GT(sum, 0) << estimator_name(estimator);
        }
    }
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

TEST_F(Tiny, FloatTablesAreMeasured) {
    const RadianceMap map = ramp_map(5, 3);
    EXPECT_EQ(undrawable_f32(device_, DeviceMap(device_, map), Luminance::average), 0U);
}

}  // namespace
}  // namespace clerestory::test
