#include "tables/table_arithmetic.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>

#include "base/exact_sum.hpp"
#include "image_files.hpp"
#include "maps.hpp"
#include "render/renderer.hpp"
#include "render/scene.hpp"
#include "run_program.hpp"
#include "sampling/stage3_sample.hpp"
#include "test_device.hpp"

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

    TestDevice device_;
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

/// One row of the table in tests/README.md: case, lit texels, then what each arithmetic cannot draw.
std::string readme_row(const std::string& name, const std::array<ArithmeticReport, 4>& reports) {
    std::string row = fmt::format("| {} | {} |", name, reports.back().lit);
    for (const ArithmeticReport& report : reports) row += fmt::format(" {} |", report.undrawable);
    return row;
}

std::vector<NamedMap> readme_maps() {
    std::vector<NamedMap> maps;
    const auto add = [&](const char* name, std::function<RadianceMap()> make) {
        maps.push_back({name, std::move(make)});
    };
    maps.push_back(
        {"8192-texel row, 16 suns of 1e6 first, sky 0.05", [] { return sun_map(8192, 1, 0, 16, 1e6F, 0.05F, true); }});
    maps.push_back(
        {"8192-texel row, 16 suns of 1e6 last, sky 0.05", [] { return sun_map(8192, 1, 0, 16, 1e6F, 0.05F, false); }});
    add("1024x512, 16 suns of 1e6 at a row's start, sky 0.05",
        [] { return sun_map(1024, 512, 200, 16, 1e6F, 0.05F, true); });
    add("1024x512, 16 suns of 1e9 at a row's start, sky 0.05",
        [] { return sun_map(1024, 512, 200, 16, 1e9F, 0.05F, true); });
    add("1024x512, 16 suns of 1e12 at a row's start, sky 0.05",
        [] { return sun_map(1024, 512, 200, 16, 1e12F, 0.05F, true); });
    add("65537x2, random over 36 powers of two", [] { return random_map(65537, 2, 7); });
    add("64x32, all 3e38 (the sum leaves float32)", [] { return constant_map(64, 32, 3e38F); });
    add("64x32, all 1e-40 (denormal)", [] { return constant_map(64, 32, 1e-40F); });
    add("511x511, constant", [] { return constant_map(511, 511, 1); });
    return maps;
}

/// The table that users read is what these tests measure.
TEST_F(TableArithmeticTest, TheReadmesTableIsWhatIsMeasured) {
    std::ifstream file(std::string(CLERESTORY_SOURCE_DIR) + "/tests/README.md");
    const std::string readme{std::istreambuf_iterator<char>(file), {}};
    for (const NamedMap& hard : readme_maps()) {
        const RadianceMap map = hard.make();
        std::array<ArithmeticReport, 4> reports;
        for (std::size_t i = 0; i < reports.size(); ++i) reports.at(i) = measure(map, TABLE_ARITHMETICS.at(i));
        EXPECT_EQ(reports.back().undrawable, 0U) << hard.name;
        EXPECT_NE(readme.find(readme_row(hard.name, reports)), std::string::npos)
            << "tests/README.md should have the row\n"
            << readme_row(hard.name, reports);
    }
}

class DrawnArithmeticTest : public testing::Test {
  protected:
    /// Mean radiance of a white sphere's equator where it faces away from suns at the map's left edge (+x), by 4
    /// million plain samples of one table arithmetic.
    double light_away_from_suns(TableArithmetic arithmetic) {
        TableBuilder builder(device_);
        SceneOptions options;
        options.arithmetic = arithmetic;
        const Scene scene(device_, builder, sun_map(SUN_ROW_WIDTH, 1, 0, SUNS, 1e6F, SKY, true), options);
        constexpr std::size_t SIZE = 63;  // odd: the middle row of pixels has y = 0
        RenderOptions render;
        render.size = SIZE;
        render.samples = SAMPLES;
        render.sampling.control_degree = 0;
        const Rendered picture = Renderer(device_).render(scene, render);
        double sum = 0;
        std::size_t count = 0;
        for (std::size_t column = 1; column < SIZE / 4; ++column) {
            sum += static_cast<double>(picture.rgba[4 * (SIZE / 2 * SIZE + column)]);
            ++count;
        }
        return sum / static_cast<double>(count);
    }

    static constexpr std::size_t SAMPLES = std::size_t{1} << 22;
    static constexpr float SKY = 0.05F;
    TestDevice device_;
};

/// What tests/README.md says of float32 tables, seen in a picture.
TEST_F(DrawnArithmeticTest, SurfacesThatFaceAwayFromSunsAreBlackWithFloat32Tables) {
    EXPECT_EQ(light_away_from_suns(TableArithmetic::f32), 0);
    // The sky is 2.6e-5 of the light: 107 of the samples. max(0, cosine) over the sphere has the mean 1/4 and the mean
    // square 1/6, so the standard error is sqrt(16 / 6 / 107).
    const double lit = light_away_from_suns(TableArithmetic::integer);
    EXPECT_NEAR(lit / static_cast<double>(SKY), 1, 4 * std::sqrt(16.0 / 6 / 107));
}

TEST_F(DrawnArithmeticTest, EvenMapsAreDrawnAlikeByEveryArithmetic) {
    TableBuilder builder(device_);
    const Scene even(device_, builder, constant_map(32, 16, 1));
    const std::vector<double> exact = texel_probabilities(even.distribution());
    for (const TableArithmetic arithmetic : TABLE_ARITHMETICS) {
        SceneOptions options;
        options.arithmetic = arithmetic;
        const Scene scene(device_, builder, constant_map(32, 16, 1), options);
        const std::vector<double> drawn = texel_probabilities(scene.distribution());
        for (std::size_t at = 0; at < drawn.size(); ++at) {
            // 32 roundings of a running sum near 1, in units of 2^-24, of a width of 1/32; rows alike.
            EXPECT_NEAR(drawn[at] / exact[at], 1, 2 * 32 * 32 * std::ldexp(1.0, -24)) << name_of(arithmetic);
        }
        // Guides fit the tables that they were made for: guided and plain search find the same texels.
        EXPECT_EQ(
            Sampler(device_, scene.device_map(), scene.distribution(), {}).draw(4096).texel.download(),
            Sampler(device_, scene.device_map(), scene.distribution(), {}, Search::plain).draw(4096).texel.download());
    }
}

TEST_F(DrawnArithmeticTest, SumsThatLeaveFloat32AreRefused) {
    TableBuilder builder(device_);
    SceneOptions options;
    options.arithmetic = TableArithmetic::f32;
    EXPECT_THROW(Scene(device_, builder, constant_map(64, 32, 3e38F), options), InputError);
    options.arithmetic = TableArithmetic::f64;
    EXPECT_NO_THROW(Scene(device_, builder, constant_map(64, 32, 3e38F), options));
}

TEST(TableArithmeticCommand, InfoMeasuresEveryArithmeticThatIsAsked) {
    const TempFolder folder;
    const std::string map = folder.file("suns.pfm");
    const RadianceMap suns = sun_map(SUN_ROW_WIDTH, 1, 0, SUNS, 1e6F, 0.05F, true);
    write_pfm(map, SUN_ROW_WIDTH, 1, {suns.rgb.data(), suns.rgb.data() + suns.rgb.size()});
    const ProgramResult result =
        run_program({"info", map, "--table-arithmetic", "f32,f32-compensated,f64,integer", "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto facts = nlohmann::json::parse(result.out)["table_arithmetic"];
    ASSERT_EQ(facts.size(), 4U);
    EXPECT_EQ(facts[0]["undrawable"], SUN_ROW_WIDTH - SUNS);
    EXPECT_EQ(facts[3]["undrawable"], 0);
    EXPECT_LT(facts[3]["largest_relative_error"].get<double>(), facts[0]["largest_relative_error"].get<double>());
    EXPECT_EQ(run_program({"info", map, "--table-arithmetic", "f16"}).exit_code, 2);
}

/// Terms that double would swallow, in any order, and their exact sum.
TEST(ExactSumTest, KeepsWhatRoundingWouldLose) {
    ExactSum sum;
    sum.add(1e300 * 1e-200);
    sum.add(1e-30);
    sum.add(-1e100);
    EXPECT_EQ(sum.value(), static_cast<long double>(1e-30));
    ExactSum small;
    for (int i = 0; i < 1 << 20; ++i) small.add_product(1.4e-45F, 0.0722F, 1e-6F);
    EXPECT_EQ(small.value(), std::ldexp(static_cast<long double>(1.4e-45F) * 0.0722F * 1e-6F, 20));
}

}  // namespace
}  // namespace clerestory
