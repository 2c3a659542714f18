#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"
#include "map/luminance.hpp"
#include "map/texel_counts.hpp"
#include "maps.hpp"
#include "reference/tables.hpp"
#include "tables/stage2_cdf.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

using namespace test;

// In ulp of the result, all terms being positive: the float luminance weights 1, the three products 1, the first sum 1
// (the part is no more than the whole), the last sum 1/2. 2.0 is the worst that was measured.
constexpr double INTENSITY_ULP = 3.5;

constexpr float NOT_A_NUMBER = std::numeric_limits<float>::quiet_NaN();
constexpr float INFINITE = std::numeric_limits<float>::infinity();

cl_uint narrow(std::size_t value) { return static_cast<cl_uint>(value); }

/// The kernels of stage1_weight.cl, run one by one.
class Stage1Weight : public testing::Test {
  protected:
    using Floats = Buffer<cl_float>;
    using TexelCountsBuffer = Buffer<TexelCounts>;
    using Weights = Buffer<RowWeight>;

    /// Weights of a map's rows, by chunks.
    std::vector<RowWeight> weigh(const RadianceMap& map, Luminance luminance) {
        const DeviceMap on_device(device_, map);
        const std::size_t chunks = (map.width + CHUNK_TEXELS - 1) / CHUNK_TEXELS;
        const std::size_t items = map.height * chunks;
        const auto share = luminance_weights_f32(luminance);
        TexelCountsBuffer parts(device_, "counts", items);
        TexelCountsBuffer rows(device_, "row counts", map.height);
        Weights part_weights(device_, "weights", items);
        Weights weights(device_, "row weights", map.height);
        count_chunks_({items, 1}, on_device.radiance, narrow(map.width), narrow(chunks), narrow(items), parts);
        join_counts_({map.height, 1}, parts, narrow(map.width), narrow(chunks), narrow(map.height), rows);
        sum_chunks_({items, 1}, on_device.radiance, rows, narrow(map.width), narrow(chunks), narrow(items), share[0],
                    share[1], share[2], part_weights);
        join_weights_({map.height, 1}, part_weights, narrow(chunks), narrow(map.height), weights);
        return weights.download();
    }

    TestDevice device_;
    Program program_{device_, "stage1_weight.cl"};
    Kernel<Floats, cl_uint, cl_uint, cl_uint, TexelCountsBuffer> count_chunks_{device_, program_, "count_chunks"};
    Kernel<TexelCountsBuffer, cl_uint, cl_uint, cl_uint, TexelCountsBuffer> join_counts_{device_, program_,
                                                                                         "join_counts"};
    Kernel<Floats, TexelCountsBuffer, cl_uint, cl_uint, cl_uint, cl_float, cl_float, cl_float, Weights> sum_chunks_{
        device_, program_, "sum_chunks"};
    Kernel<Weights, cl_uint, cl_uint, Weights> join_weights_{device_, program_, "join_weights"};
};

/// A map of one column whose every row is one texel: a row's sum is then the texel's intensity to its last bit, since
/// an intensity of at least 2^-5 has no bit below 2^-29.
RadianceMap column_of_texels(std::size_t count) {
    std::mt19937 bits(11);
    return make_map(1, count, [&](std::size_t, std::size_t) {
        const int exponent = static_cast<int>(bits() % 40) - 20;
        std::array<float, 3> rgb{};
        for (float& component : rgb) component = std::ldexp(static_cast<float>(bits() >> 8), exponent - 24);
        return rgb;
    });
}

TEST_F(Stage1Weight, IntensityErrorIsWhatTheKernelStates) {
    constexpr std::size_t COUNT = 200000;
    const RadianceMap map = column_of_texels(COUNT);
    for (const Luminance luminance : {Luminance::average, Luminance::rec709}) {
        const std::vector<RowWeight> weights = weigh(map, luminance);
        const std::vector<long double> exact = reference::intensities(map, luminance);
        double worst = 0;
        for (std::size_t i = 0; i < COUNT; ++i) {
            const long double found = std::ldexp(static_cast<long double>(weights[i].sum), weights[i].exponent - 29);
            const long double ulp = std::ldexp(1.0L, std::ilogb(exact[i]) - 23);
            worst = std::max(worst, static_cast<double>(std::abs(found - exact[i]) / ulp));
        }
        RecordProperty(luminance == Luminance::average ? "ulp_average" : "ulp_rec709", std::to_string(worst));
        EXPECT_LE(worst, INTENSITY_ULP);
        EXPECT_GT(worst, 0);
    }
}

TEST_F(Stage1Weight, SumsEqualTheReferenceToTheBit) {
    for (const NamedMap& hard : hard_maps()) {
        const RadianceMap map = hard.make();
        for (const Luminance luminance : {Luminance::average, Luminance::rec709}) {
            const std::vector<RowWeight> weights = weigh(map, luminance);
            for (std::size_t i = 0; i < map.height; ++i) {
                const reference::RowTable row = reference::row_table(
                    {map.rgb.data() + 3 * i * map.width, 3 * map.width}, luminance_weights_f32(luminance));
                ASSERT_EQ(weights[i].sum, row.sum) << hard.name << " row " << i;
                ASSERT_EQ(weights[i].exponent, row.exponent) << hard.name << " row " << i;
                ASSERT_EQ(weights[i].lit, row.lit) << hard.name << " row " << i;
            }
        }
    }
}

/// A colour that only its smallest luminance share sees is lit all the same, and never weighs nothing.
TEST_F(Stage1Weight, ThePurestColoursAreLit) {
    const RadianceMap map = make_map(3, 1, [](std::size_t, std::size_t j) {
        std::array<float, 3> rgb{};
        rgb.at(j) = 1.4e-45F;
        return rgb;
    });
    const std::vector<RowWeight> weights = weigh(map, Luminance::rec709);
    EXPECT_EQ(weights[0].lit, 3U);
    EXPECT_GE(weights[0].sum, 3U);
}

struct CountsCase {
    std::string name;
    std::size_t width;
    std::size_t height;
    std::vector<std::pair<std::size_t, std::array<float, 3>>> texels;  ///< index and value, the others are 1
};

class Stage1WeightCounts : public testing::TestWithParam<CountsCase> {};

TEST_P(Stage1WeightCounts, CountsEachBadTexelOnceAndNamesTheFirst) {
    const CountsCase& c = GetParam();
    RadianceMap map = constant_map(c.width, c.height, 1);
    for (const auto& [at, rgb] : c.texels) std::copy(rgb.begin(), rgb.end(), map.rgb.data() + 3 * at);
    const TestDevice device;
    const DeviceMap on_device(device, map);
    TableBuilder builder(device);
    const MapCounts wanted = reference::count_texels(map);
    const MapCounts found = builder.count_texels(on_device);
    EXPECT_EQ(found.nan, wanted.nan);
    EXPECT_EQ(found.inf, wanted.inf);
    EXPECT_EQ(found.negative, wanted.negative);
    EXPECT_EQ(found.zero, wanted.zero);
    EXPECT_EQ(found.max_component, wanted.max_component);
    EXPECT_EQ(found.first_bad_row, wanted.first_bad_row);
    EXPECT_EQ(found.first_bad_column, wanted.first_bad_column);

    for (const ScanPath path : {ScanPath::rows, ScanPath::chunks}) {
        if (wanted.bad() == 0) {
            EXPECT_NO_THROW((void)builder.build(on_device, {Luminance::average, path}));
            continue;
        }
        try {
            (void)builder.build(on_device, {Luminance::average, path});
            ADD_FAILURE() << "bad texels were accepted";
        } catch (const InputError& error) {
            EXPECT_EQ(error.exit_code(), 3);
            EXPECT_THAT(error.what(), testing::HasSubstr(describe_bad_texels(wanted)));
        }
    }
    EXPECT_EQ(zero_bad_texels(map), wanted.bad());
    EXPECT_EQ(reference::count_texels(map).bad(), 0U);
    EXPECT_NO_THROW((void)builder.build(DeviceMap(device, map)));
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, Stage1WeightCounts,
    testing::Values(
        CountsCase{"Clean", 7, 5, {}}, CountsCase{"NanAtTheFirstTexel", 7, 5, {{0, {NOT_A_NUMBER, 1, 1}}}},
        CountsCase{"NanAtTheLastTexel", 7, 5, {{34, {1, 1, NOT_A_NUMBER}}}},
        CountsCase{"InfiniteGreen", 7, 5, {{12, {1, INFINITE, 1}}}},
        CountsCase{"NegativeInfinityIsInfinite", 7, 5, {{12, {1, -INFINITE, 1}}}},
        CountsCase{"NegativeBlue", 7, 5, {{13, {0, 0, -1e-45F}}}},
        CountsCase{
            "NanBeforeInfiniteBeforeNegative", 7, 5, {{3, {NOT_A_NUMBER, INFINITE, -1}}, {4, {INFINITE, -1, 1}}}},
        CountsCase{"NegativeZeroIsZero", 7, 5, {{8, {-0.0F, -0.0F, -0.0F}}, {9, {0, -0.0F, 0}}}},
        CountsCase{
            "TheFirstOfSeveralRows", 7, 5, {{30, {-1, 1, 1}}, {17, {INFINITE, 1, 1}}, {20, {NOT_A_NUMBER, 1, 1}}}},
        CountsCase{"OneTexel", 1, 1, {{0, {NOT_A_NUMBER, 0, 0}}}},
        CountsCase{"LastOfAChunk", CHUNK_TEXELS + 3, 2, {{CHUNK_TEXELS - 1, {-1, 0, 0}}}},
        CountsCase{"FirstOfASecondChunk",
                   CHUNK_TEXELS + 3,
                   2,
                   {{CHUNK_TEXELS, {-1, 0, 0}}, {CHUNK_TEXELS + 2, {INFINITE, 0, 0}}}},
        CountsCase{"ABadTexelHidesNoMaximum", 4, 1, {{0, {INFINITE, 9, 9}}, {2, {5, 6, 7}}}}),
    [](const auto& each) { return each.param.name; });

// phi adds exact integers, so it is off by the roundings of each texel alone: its intensity's, and half a unit
// of 2^-29 of the row's largest component, which makes at most the average luminance's third of it or more.
TEST_F(Stage1Weight, PhiIsTheIntegralWithinTheRoundingOfTexels) {
    TableBuilder builder(device_);
    for (const NamedMap& hard : hard_maps()) {
        const RadianceMap map = hard.make();
        const double relative = INTENSITY_ULP * std::ldexp(1.0, -23);
        const double fixed_point = static_cast<double>(map.width) * std::ldexp(0.5, -29) * 2 * 3;
        const Distribution built = builder.build(DeviceMap(device_, map));
        const auto exact = static_cast<double>(reference::phi(map, Luminance::average));
        EXPECT_NEAR(built.phi / exact, 1, relative + fixed_point) << hard.name;
    }
}

}  // namespace
}  // namespace clerestory
