#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "map/latlong.hpp"
#include "map/luminance.hpp"
#include "maps.hpp"
#include "reference/tables.hpp"
#include "tables/stage2_cdf.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

using namespace test;

struct Tables {
    std::vector<cl_uint> marginal;
    std::vector<cl_uint> conditional;
    std::vector<cl_uint> marginal_guide;
    std::vector<cl_uint> conditional_guide;
    bool operator==(const Tables&) const = default;
};

Tables tables_of(const Distribution& built) {
    return {built.marginal.download(), built.conditional.download(), built.marginal_guide.download(),
            built.conditional_guide.download()};
}

Tables built_with(const DeviceOptions& options, const RadianceMap& map, ScanPath path) {
    const TestDevice device(options);
    return tables_of(TableBuilder(device).build(DeviceMap(device, map), {Luminance::average, path}));
}

bool has_light(const RadianceMap& map, std::size_t at) {
    return map.rgb[3 * at] > 0 || map.rgb[3 * at + 1] > 0 || map.rgb[3 * at + 2] > 0;
}

class Stage2Cdf : public testing::Test {
  protected:
    Distribution build(const RadianceMap& map, const TableOptions& options = {}) {
        return builder_.build(DeviceMap(device_, map), options);
    }

    TestDevice device_;
    TableBuilder builder_{device_};
};

/// Integer tables have one right answer, whichever way the rows were shared out.
TEST_F(Stage2Cdf, TablesEqualTheReferenceToTheBitOnBothScanPaths) {
    for (const NamedMap& hard : hard_maps()) {
        const RadianceMap map = hard.make();
        const std::vector<float> sine = row_geometry(map.width, map.height).sine;
        for (const Luminance luminance : {Luminance::average, Luminance::rec709}) {
            const Tables rows = tables_of(build(map, {luminance, ScanPath::rows}));
            EXPECT_EQ(rows, tables_of(build(map, {luminance, ScanPath::chunks}))) << hard.name;
            std::vector<reference::RowTable> wanted;
            for (std::size_t i = 0; i < map.height; ++i) {
                wanted.push_back(reference::row_table({map.rgb.data() + 3 * i * map.width, 3 * map.width},
                                                      luminance_weights_f32(luminance)));
                const auto first = rows.conditional.begin() + static_cast<std::ptrdiff_t>(i * map.width);
                ASSERT_TRUE(std::equal(wanted.back().end.begin(), wanted.back().end.end(), first))
                    << hard.name << " row " << i;
            }
            ASSERT_EQ(rows.marginal, reference::marginal(wanted, sine)) << hard.name;
        }
    }
}

/// A row of each kind that is built in a way of its own: by sixteen or texel by texel, with guide entries that texels
/// share or span.
RadianceMap rows_of_every_kind(std::size_t width) {
    using Value = std::function<float(std::size_t)>;
    const auto uneven = [](std::size_t j) { return 1 + static_cast<float>(j * 7 % 13); };
    const auto scaled = [&](float scale) -> Value { return [=](std::size_t j) { return uneven(j) / 16 * scale; }; };
    const std::vector<Value> kinds = {
        [](std::size_t) { return 1.0F; },
        [](std::size_t) { return 0.0F; },
        uneven,
        [&](std::size_t j) { return j % 3 == 1 ? -0.0F : uneven(j); },
        [=](std::size_t j) { return j == 0 ? 1.0F : 0.0F; },
        [=](std::size_t j) { return j + 1 == width ? 1.0F : 0.0F; },
        [=](std::size_t j) { return j == width / 2 ? 1e6F : 0.05F; },
        [=](std::size_t j) { return j < width / 3 ? 0.0F : uneven(j); },
        [=](std::size_t j) { return j < width / 3 ? uneven(j) : 0.0F; },
        [](std::size_t j) { return j % 5 == 0 ? 1.0F : 0x1p-149F; },  // lit, and lost in any sum
        [](std::size_t j) { return j % 2 == 0 ? 0x1p-40F : 0x1p-126F; },
        scaled(0x1p-39F),
        scaled(0x1p-40F),
        scaled(0x1p-41F),
        scaled(0x1p-140F),
        scaled(0x1p99F),
        scaled(0x1p100F),
        scaled(0x1p101F),
        [](std::size_t j) { return j % 2 == 0 ? std::numeric_limits<float>::max() : 1.0F; },
    };
    return make_map(width, kinds.size(), [&](std::size_t row, std::size_t column) -> std::array<float, 3> {
        const float value = kinds[row](column);
        return {value, value / 2, value * 0.75F};
    });
}

TEST_F(Stage2Cdf, RowsOfEveryKindAndWidthEqualTheReferenceAndTheChunks) {
    for (const std::size_t width : {1U, 2U, 3U, 5U, 15U, 16U, 17U, 33U, 255U, 256U, 257U, 272U, 521U, 4097U}) {
        const RadianceMap map = rows_of_every_kind(width);
        const Tables rows = tables_of(build(map, {Luminance::rec709, ScanPath::rows}));
        EXPECT_EQ(rows, tables_of(build(map, {Luminance::rec709, ScanPath::chunks}))) << width << " wide";
        for (std::size_t i = 0; i < map.height; ++i) {
            const auto wanted = reference::row_table({map.rgb.data() + 3 * i * width, 3 * width},
                                                     luminance_weights_f32(Luminance::rec709));
            const auto first = rows.conditional.begin() + static_cast<std::ptrdiff_t>(i * width);
            ASSERT_TRUE(std::equal(wanted.end.begin(), wanted.end.end(), first)) << width << " wide, row " << i;
        }
    }
}

TEST_F(Stage2Cdf, BadTexelsAreCountedAlikeByRowsAndByChunks) {
    RadianceMap map = rows_of_every_kind(37);
    map.rgb[3 * (2 * 37 + 36) + 1] = std::numeric_limits<float>::quiet_NaN();
    map.rgb[3 * (5 * 37 + 16)] = std::numeric_limits<float>::infinity();
    map.rgb[3 * (5 * 37 + 3) + 2] = -1;
    const auto complaint = [&](ScanPath path) -> std::string {
        try {
            build(map, {Luminance::average, path});
        } catch (const InputError& error) {
            return error.what();
        }
        return "none";
    };
    EXPECT_THAT(complaint(ScanPath::rows), testing::StartsWith("1 NaN, 1 infinite and 1 negative texels, the first at "
                                                               "row 2, column 36"));
    EXPECT_EQ(complaint(ScanPath::rows), complaint(ScanPath::chunks));
}

/// A device that takes small numbers for 0 either gives the same bits or says that it cannot.
TEST(Stage2CdfFlushing, MapsThatNeedSmallNumbersAreRefusedAndOthersAreTheSame) {
    const DeviceOptions flushing{.act_as = ActAs::flushing_accelerator};
    for (const NamedMap& hard : hard_maps()) {
        const RadianceMap map = hard.make();
        const float* const end = map.rgb.data() + map.rgb.size();
        const bool small = std::any_of(map.rgb.data(), end, [](float v) { return v != 0 && std::abs(v) < 0x1p-126F; });
        if (small) {
            EXPECT_THROW(built_with(flushing, map, ScanPath::automatic), DeviceError) << hard.name;
        } else {
            EXPECT_EQ(built_with(flushing, map, ScanPath::automatic), built_with({}, map, ScanPath::automatic))
                << hard.name;
        }
    }
}

TEST_F(Stage2Cdf, TablesBuiltIntoOldArraysAreTheSame) {
    const RadianceMap map = rows_of_every_kind(521);
    const DeviceMap on_device(device_, map);
    const Tables wanted = tables_of(builder_.build(on_device));
    Distribution old = builder_.build(DeviceMap(device_, rows_of_every_kind(520)));
    old = builder_.build(on_device, {}, std::move(old));  // of another size
    EXPECT_EQ(tables_of(old), wanted);
    old.conditional.fill(7);
    old.conditional_guide.fill(7);
    EXPECT_EQ(tables_of(builder_.build(on_device, {}, std::move(old))), wanted);
}

TEST_F(Stage2Cdf, TablesBuiltBandByBandInAnyOrderAreTheSame) {
    for (const NamedMap& hard : hard_maps()) {
        const RadianceMap map = hard.make();
        const DeviceMap on_device(device_, map);
        for (const ScanPath path : {ScanPath::rows, ScanPath::chunks}) {
            UnfinishedTables tables = builder_.start(map.width, map.height, {Luminance::average, path});
            const std::size_t band = map.height / 3 + 1;
            for (std::size_t end = map.height; end != 0; end -= std::min(end, band)) {
                builder_.add_rows(tables, on_device, end - std::min(end, band), end);
            }
            const Distribution built = builder_.finish(std::move(tables), on_device);
            const Distribution whole = build(map, {Luminance::average, path});
            EXPECT_EQ(tables_of(built), tables_of(whole)) << hard.name;
            EXPECT_EQ(built.phi, whole.phi) << hard.name;
            EXPECT_EQ(built.exponent, whole.exponent) << hard.name;
            EXPECT_EQ(built.counts.zero, whole.counts.zero) << hard.name;
        }
    }
}

TEST_F(Stage2Cdf, EveryLitTexelHasWidthAndNoBlackOneAny) {
    for (const NamedMap& hard : hard_maps()) {
        const RadianceMap map = hard.make();
        const Tables tables = tables_of(build(map));
        for (std::size_t i = 0; i < map.height; ++i) {
            bool lit_row = false;
            for (std::size_t j = 0; j < map.width; ++j) {
                const std::size_t at = i * map.width + j;
                const cl_uint start = j == 0 ? 0 : tables.conditional[at - 1];
                ASSERT_GE(tables.conditional[at], start) << hard.name << " texel " << i << ' ' << j;
                ASSERT_EQ(tables.conditional[at] > start, has_light(map, at))
                    << hard.name << " texel " << i << ' ' << j;
                lit_row = lit_row || has_light(map, at);
            }
            const cl_uint row_start = i == 0 ? 0 : tables.marginal[i - 1];
            ASSERT_GE(tables.marginal[i], row_start) << hard.name << " row " << i;
            ASSERT_EQ(tables.marginal[i] > row_start, lit_row) << hard.name << " row " << i;
            ASSERT_EQ(tables.conditional[(i + 1) * map.width - 1], lit_row ? TABLE_ONE : 0U)
                << hard.name << " row " << i;
        }
        ASSERT_EQ(tables.marginal.back(), TABLE_ONE) << hard.name;
    }
}

TEST_F(Stage2Cdf, GuidesNameTheFirstAndTheLastTexelOfTheirPart) {
    for (const NamedMap& hard : hard_maps()) {
        const Distribution built = build(hard.make());
        const Tables tables = tables_of(built);
        const auto check = [&](const cl_uint* table, std::size_t count, const cl_uint* guide, unsigned bits) {
            const std::size_t parts = std::size_t{1} << bits;
            for (std::size_t b = 0; b <= parts; ++b) {
                const std::uint64_t value = b == parts ? TABLE_ONE - 1 : b << (TABLE_BITS - bits);
                const cl_uint* above = std::find_if(table, table + count, [&](cl_uint end) { return end > value; });
                const auto wanted = std::min<std::size_t>(static_cast<std::size_t>(above - table), count - 1);
                ASSERT_EQ(guide[b], wanted) << hard.name << " part " << b;
                if (b > 64 && b + 64 < parts) b += parts / 64;  // both ends whole, and a part of what lies between
            }
        };
        check(tables.marginal.data(), built.height, tables.marginal_guide.data(), built.row_bits);
        const std::size_t entries = (std::size_t{1} << built.column_bits) + 1;
        for (std::size_t i = 0; i < built.height; i += 1 + built.height / 8) {
            check(tables.conditional.data() + i * built.width, built.width,
                  tables.conditional_guide.data() + i * entries, built.column_bits);
        }
    }
}

/// Bits depend on the map alone: neither on the size of work-groups nor on the threads.
TEST(Stage2CdfAnyDevice, TablesAreTheSameForEveryWorkGroupAndThreadCount) {
    for (const RadianceMap& map : {random_map(257, 89, 3), sun_map(65537, 2, 1, 16, 1e9F, 0.05F, false)}) {
        const Tables wanted = built_with({}, map, ScanPath::rows);
        for (const ScanPath path : {ScanPath::rows, ScanPath::chunks}) {
            for (const std::size_t group : {1U, 3U, 64U}) {
                EXPECT_EQ(built_with(DeviceOptions{"", 0, group}, map, path), wanted) << "groups of " << group;
            }
            for (const unsigned threads : {1U, 2U}) {
                EXPECT_EQ(built_with(DeviceOptions{"", threads_where_possible(threads), 0}, map, path), wanted)
                    << threads << " threads";
            }
        }
    }
}

/// Rows as far from a pole as each other have the same table from the same radiance, and the same share.
TEST_F(Stage2Cdf, MirroredRowsAreEqualToTheBit) {
    for (const std::size_t height : {2U, 3U, 31U, 512U}) {
        const Tables tables = tables_of(build(constant_map(4, height, 0.7F)));
        const RowGeometry geometry = row_geometry(4, height);
        for (std::size_t i = 0; i < height; ++i) EXPECT_EQ(geometry.sine[i], geometry.sine[height - 1 - i]);
        // Each end is cut to a unit; per_unit and its divisor are cut to 32 bits, a unit each at the end of the table,
        // which the last row gets back.
        constexpr double CUT_UNITS = 4;
        for (std::size_t i = 0; i < height; ++i) {
            const auto width = [&](std::size_t row) {
                return static_cast<std::int64_t>(tables.marginal[row]) - (row == 0 ? 0 : tables.marginal[row - 1]);
            };
            EXPECT_NEAR(static_cast<double>(width(i)), static_cast<double>(width(height - 1 - i)), CUT_UNITS)
                << "row " << i;
        }
    }
}

// Widths are integers that add up to 2^62 exactly; what is off is double's own sum of their 2^53-rounded products.
constexpr double SUM_TOLERANCE = 1e-9;

TEST_F(Stage2Cdf, DensityTimesSolidAngleAddsUpToOne) {
    for (const NamedMap& hard : hard_maps()) {
        const Distribution built = build(hard.make());
        const std::vector<double> probabilities = texel_probabilities(built);
        const std::vector<double> solid_angles = texel_solid_angles(built.width, built.height);
        double sum = 0;
        double sphere = 0;
        for (std::size_t at = 0; at < probabilities.size(); ++at) {
            const double solid_angle = solid_angles[at / built.width];
            const double pdf = probabilities[at] / solid_angle;
            sum += pdf * solid_angle;
            sphere += solid_angle;
        }
        EXPECT_NEAR(sum, 1, SUM_TOLERANCE) << hard.name;
        EXPECT_NEAR(sphere / (4 * std::acos(-1.0)), 1, SUM_TOLERANCE) << hard.name;
    }
}

// A texel's width is its exact share within: one unit that a lit texel gets at least, one for each of two cuts, the
// margin's 256 and the lit texels' own units spread over all (a relative 2^-31 (256 + lit)), and the float product's
// 2^-22.
TEST_F(Stage2Cdf, ProbabilitiesAreProportionalToTheWeights) {
    for (const NamedMap& hard : hard_maps()) {
        const RadianceMap map = hard.make();
        const Tables tables = tables_of(build(map));
        const std::vector<long double> intensity = reference::intensities(map, Luminance::average);
        const double units = 3;
        const double relative = std::ldexp(256.0 + static_cast<double>(map.width), -30) + std::ldexp(1.0, -22);
        for (std::size_t i = 0; i < map.height; i += 1 + map.height / 16) {
            long double row_sum = 0;
            for (std::size_t j = 0; j < map.width; ++j) row_sum += intensity[i * map.width + j];
            if (row_sum == 0) continue;
            for (std::size_t j = 0; j < map.width; ++j) {
                const std::size_t at = i * map.width + j;
                const double width = static_cast<double>(tables.conditional[at]) -
                                     (j == 0 ? 0 : static_cast<double>(tables.conditional[at - 1]));
                const double wanted = std::ldexp(static_cast<double>(intensity[at] / row_sum), TABLE_BITS);
                ASSERT_NEAR(width, wanted, units + relative * wanted) << hard.name << " texel " << i << ' ' << j;
            }
        }
    }
}

TEST_F(Stage2Cdf, ABlackMapHasNoWidthAnywhere) {
    const Distribution built = build(constant_map(33, 7, 0));
    EXPECT_TRUE(built.black());
    const Tables tables = tables_of(built);
    for (const cl_uint end : tables.conditional) ASSERT_EQ(end, 0U);
    for (const cl_uint end : tables.marginal) ASSERT_EQ(end, 0U);
    EXPECT_EQ(built.counts.zero, 33U * 7U);
}

}  // namespace
}  // namespace clerestory
