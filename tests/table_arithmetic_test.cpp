#include "table_arithmetic.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "maps.hpp"
#include "reference/exact_sum.hpp"

namespace clerestory {
namespace {

using namespace test;

class TableArithmeticTest : public testing::Test {
  protected:
    ArithmeticReport measure(const RadianceMap& map, TableArithmetic arithmetic) {
        return measure_table_arithmetic(device_, DeviceMap(device_, map), Luminance::average, arithmetic);
    }
    std::uint64_t undrawable(const RadianceMap& map) {
        return undrawable_f32(device_, DeviceMap(device_, map), Luminance::average);
    }

    Device device_;
};

constexpr std::size_t SUN_ROW_WIDTH = 8192;
constexpr std::size_t SUNS = 16;

/// 16 suns of 1e6 at the start: their sum of 1.6e7 has a unit of 1 in float32, and every later 0.05 rounds away.
TEST_F(TableArithmeticTest, Float32LosesTheWholeSkyOfASunRow) {
    const RadianceMap map = sun_map(SUN_ROW_WIDTH, 1, 0, SUNS, 1e6F, 0.05F, true);
    EXPECT_EQ(undrawable(map), SUN_ROW_WIDTH - SUNS);
    EXPECT_EQ(measure(map, TableArithmetic::f32).undrawable, SUN_ROW_WIDTH - SUNS);
}

/// With the sums right, the table's own float32 ends are still too coarse above the suns.
TEST_F(TableArithmeticTest, CompensationLosesMostOfTheSky) {
    const ArithmeticReport report =
        measure(sun_map(SUN_ROW_WIDTH, 1, 0, SUNS, 1e6F, 0.05F, true), TableArithmetic::f32_compensated);
    EXPECT_GT(report.undrawable, (SUN_ROW_WIDTH - SUNS) / 2);
    // Kahan's bound: 2 units of rounding, whatever the count of terms.
    EXPECT_LE(report.total_relative_error, 2 * std::ldexp(1.0, -24));
}

TEST_F(TableArithmeticTest, IntegerAndFloat64TablesDrawEveryLitTexelOfASunRow) {
    for (const TableArithmetic arithmetic : {TableArithmetic::f64, TableArithmetic::integer}) {
        const ArithmeticReport report = measure(sun_map(SUN_ROW_WIDTH, 1, 0, SUNS, 1e6F, 0.05F, true), arithmetic);
        EXPECT_EQ(report.undrawable, 0U) << name_of(arithmetic);
        EXPECT_EQ(report.lit, SUN_ROW_WIDTH) << name_of(arithmetic);
    }
}

TEST_F(TableArithmeticTest, Float32LosesNothingOfAConstantMap) { EXPECT_EQ(undrawable(constant_map(64, 32, 1)), 0U); }

/// The weighted sum of 3e38 over a row leaves float32: no quotient is a number, no texel can be drawn.
TEST_F(TableArithmeticTest, Float32LosesAMapWhoseSumOverflows) {
    EXPECT_EQ(undrawable(constant_map(64, 32, 3e38F)), 64U * 32U);
}

/// A black map has nothing to lose; a bad texel counts as black.
TEST_F(TableArithmeticTest, BlackAndBadTexelsAreNotLost) {
    EXPECT_EQ(undrawable(constant_map(8, 4, 0)), 0U);
    RadianceMap map = constant_map(8, 4, 1);
    map.rgb[0] = std::nanf("");
    map.rgb[4] = -1;
    map.rgb[8] = INFINITY;
    const ArithmeticReport report = measure(map, TableArithmetic::f32);
    EXPECT_EQ(report.lit, 8U * 4U - 3U);
    EXPECT_EQ(report.undrawable, 0U);
}

/// Terms that double would swallow, in any order, and their exact sum.
TEST(ExactSumTest, KeepsWhatRoundingWouldLose) {
    reference::ExactSum sum;
    sum.add(1e300 * 1e-200);
    sum.add(1e-30);
    sum.add(-1e100);
    EXPECT_EQ(sum.value(), static_cast<long double>(1e-30));
    reference::ExactSum small;
    for (int i = 0; i < 1 << 20; ++i) small.add_product(1.4e-45F, 0.0722F, 1e-6F);
    EXPECT_EQ(small.value(), std::ldexp(static_cast<long double>(1.4e-45F) * 0.0722F * 1e-6F, 20));
}

}  // namespace
}  // namespace clerestory
