#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>

#include "chi_square.hpp"
#include "lit_map.hpp"
#include "maps.hpp"
#include "sampling/stage3_sample.hpp"
#include "shading/pixels.hpp"
#include "shading/shared.hpp"
#include "test_device.hpp"

// Maps of 134 million texels. Label `large`: left out of the default suite, run by tests/run_large.sh.
namespace clerestory {
namespace {

using namespace test;

constexpr std::size_t WIDTH = 16384;
constexpr std::size_t HEIGHT = 8192;
constexpr long MOST_KIB = 6L << 20;

/// What the process has held at most, KiB.
long peak_kib() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
}

/// The sphere that a map lights: finite everywhere, and lit somewhere.
void expect_renders(const Device& device, LitMap& lit) {
    const SphereView view(device, 33);
    auto unit_albedo_radiance = view.planes(device);
    SharedShader(device).shade(lit.sampler, lit.distribution, view, 1024, unit_albedo_radiance);
    double sum = 0;
    for (const float value : unit_albedo_radiance.download()) {
        ASSERT_TRUE(std::isfinite(value));
        sum += value;
    }
    EXPECT_GT(sum, 0);
}

TEST(Large, OneLitTexelAmongMillionsIsAllThatIsDrawn) {
    constexpr std::size_t ROW = 4321;
    constexpr std::size_t COLUMN = 12345;
    const TestDevice device;
    LitMap lit(device, lone_texel_map(WIDTH, HEIGHT, ROW, COLUMN));
    const SampleSet set = lit.sampler.draw(1'000'000);
    for (const cl_uint texel : set.texel.download()) ASSERT_EQ(texel, ROW * WIDTH + COLUMN);
    const auto pdf = static_cast<double>(set.pdf.download()[0]);
    // Its one rounded solid angle and an inexact quotient.
    EXPECT_NEAR(pdf * static_cast<double>(reference::solid_angle(ROW, WIDTH, HEIGHT)), 1, 4 * 0x1p-24);
    expect_renders(device, lit);
    EXPECT_LT(peak_kib(), MOST_KIB);
}

/// Not a large map but a large number: 1e9 draws, shared out among the hard maps, none of a black texel.
TEST(Large, ABillionDrawsOfTheHardMapsHitNoBlackTexel) {
    constexpr std::size_t DRAWS = 1'000'000'000;
    constexpr std::size_t BATCH = std::size_t{1} << 20;
    const TestDevice device;
    const std::vector<NamedMap> maps = hard_maps();
    std::size_t drawn = 0;
    for (const NamedMap& hard : maps) {
        LitMap lit(device, hard.make());
        std::vector<char> is_lit(lit.map.width * lit.map.height);
        for (std::size_t texel = 0; texel < is_lit.size(); ++texel) is_lit[texel] = lit.is_lit(texel) ? 1 : 0;
        SampleSet set = lit.sampler.allocate(BATCH);
        std::vector<cl_uint> texels(BATCH);
        std::size_t impossible = 0;
        for (std::size_t first = 0; first * maps.size() < DRAWS; first += BATCH) {
            lit.sampler.draw_into(set, first);
            set.texel.download(texels);
            for (const cl_uint texel : texels) impossible += texel >= is_lit.size() || is_lit[texel] == 0 ? 1 : 0;
            drawn += BATCH;
        }
        EXPECT_EQ(impossible, 0U) << hard.name;
    }
    EXPECT_GE(drawn, DRAWS);
}

TEST(Large, EqualTexelsHaveEqualWidthsAndAreDrawnEvenly) {
    const TestDevice device;
    LitMap lit(device, constant_map(WIDTH, HEIGHT, 1));
    // A row of 2^14 equal texels: each gets 2^31 / 2^14 units but for two cuts.
    for (std::size_t at = 0; at < WIDTH * HEIGHT; ++at) {
        const cl_uint start = at % WIDTH == 0 ? 0 : lit.conditional[at - 1];
        ASSERT_NEAR(static_cast<double>(lit.conditional[at] - start), 0x1p17, 2) << at;
    }
    std::vector<std::uint64_t> counts(HEIGHT, 0);
    std::vector<double> shares(HEIGHT);
    for (const cl_uint texel : lit.sampler.draw(10'000'000).texel.download()) ++counts.at(texel / WIDTH);
    for (std::size_t i = 0; i < HEIGHT; ++i) {
        shares[i] = std::ldexp(static_cast<double>(lit.marginal[i] - (i == 0 ? 0 : lit.marginal[i - 1])), -TABLE_BITS);
    }
    const ChiSquare fit = chi_square(counts, shares);
    EXPECT_LE(fit.sigmas, CHI_SQUARE_SIGMAS);
    EXPECT_EQ(fit.impossible, 0U);
    expect_renders(device, lit);
    EXPECT_LT(peak_kib(), MOST_KIB);
}

TEST(Large, EveryTexelBesideSunsCanBeDrawn) {
    const TestDevice device;
    for (const bool at_start : {true, false}) {
        LitMap lit(device, sun_map(WIDTH, HEIGHT, HEIGHT / 3, 16, 1e12F, 0.05F, at_start));
        for (std::size_t at = 0; at < WIDTH * HEIGHT; ++at) {
            const cl_uint start = at % WIDTH == 0 ? 0 : lit.conditional[at - 1];
            ASSERT_GT(lit.conditional[at], start) << at;
        }
        for (std::size_t i = 0; i < HEIGHT; ++i) ASSERT_GT(lit.marginal[i], i == 0 ? 0U : lit.marginal[i - 1]) << i;
        expect_renders(device, lit);
    }
    EXPECT_LT(peak_kib(), MOST_KIB);
}

}  // namespace
}  // namespace clerestory
