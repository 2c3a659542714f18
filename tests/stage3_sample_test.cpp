#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "chi_square.hpp"
#include "lit_map.hpp"
#include "maps.hpp"
#include "reference/draw.hpp"
#include "reference/sequence.hpp"
#include "sampling/stage3_sample.hpp"
#include "tables/stage2_cdf.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

using namespace test;

// A place within a texel is (u - 2 start + 1/2) / (2 width): the difference, the sum and the quotient round once each,
// all below one, and a fraction that would round up to 1 is held one unit below it.
constexpr double WITHIN_TOLERANCE = 3 * 0x1p-24;
// Of the direction of the place within the texel as the kernel has it: phi in turns below 2 is rounded to 2^-24 of a
// turn (half a unit of 2^-23), 3.7e-7 radian; column + along to 2^-24 of the width, which is as much again; cosine and
// sine of phi and of theta add a few units of 2^-24.
constexpr double DIRECTION_TOLERANCE = 2 * std::numbers::pi * (0x1p-24 + 0x1p-24) + 4 * 0x1p-24;
// Four roundings (two conversions, their product, the solid angle), each up to an ulp of the result, and a quotient
// that OpenCL lets be off by 2.5 ulp.
constexpr double PDF_ULP = 6.5;

/// Fractions at 0, at the last value, and on both sides of every end of a table (of some of them, in a long table).
std::set<cl_uint> fractions_at_ends(std::span<const cl_uint> ends) {
    constexpr std::size_t MOST_ENDS = 64;
    std::set<cl_uint> fractions = {0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF};
    const std::size_t step = 1 + ends.size() / MOST_ENDS;
    for (std::size_t i = 0; i < ends.size(); i += step) {
        const cl_uint end = 2 * ends[i];  // the last end, 2^31, wraps to 0
        for (const cl_uint u : {end - 2, end - 1, end, end + 1, end + 2}) fractions.insert(u);
    }
    return fractions;
}

/// Pairs of fractions: the marginal's ends, and in each row that they draw some of the row's own.
std::vector<cl_uint> points_at_ends(const reference::TablesView& tables) {
    std::vector<cl_uint> points;
    std::set<std::size_t> seen;
    for (const cl_uint u_row : fractions_at_ends(tables.marginal)) {
        const std::size_t row = reference::first_above(tables.marginal, u_row / 2);
        const bool first_visit = seen.insert(row).second;
        if (!first_visit || seen.size() > 8) {
            points.insert(points.end(), {u_row, 0, u_row, 0xFFFFFFFF});
            continue;
        }
        for (const cl_uint u_column : fractions_at_ends(tables.conditional.subspan(row * tables.width, tables.width))) {
            points.insert(points.end(), {u_row, u_column});
        }
    }
    return points;
}

class Stage3Sample : public testing::Test {
  protected:
    TestDevice device_;
};

/// No fraction draws a black texel or leaves the table, and the place within inverts the draw.
TEST_F(Stage3Sample, EveryEndOfEveryTableDrawsWhatALinearSearchDraws) {
    double worst = 0;
    for (const NamedMap& hard : hard_maps()) {
        LitMap lit(device_, hard.make());
        const std::vector<cl_uint> points = points_at_ends(lit.tables());
        const Sampler::Located located = lit.sampler.locate(points);
        for (std::size_t k = 0; k < located.texel.size(); ++k) {
            const reference::Drawn wanted = reference::draw(lit.tables(), points[2 * k], points[2 * k + 1]);
            ASSERT_EQ(located.texel[k], wanted.row * lit.map.width + wanted.column)
                << hard.name << " u " << points[2 * k] << ' ' << points[2 * k + 1];
            ASSERT_TRUE(lit.is_lit(located.texel[k])) << hard.name;
            for (std::size_t axis = 0; axis < 2; ++axis) {
                const float within = located.within[2 * k + axis];
                ASSERT_GT(within, 0) << hard.name;
                ASSERT_LT(within, 1) << hard.name;
                const auto exact = static_cast<double>(axis == 0 ? wanted.down : wanted.along);
                worst = std::max(worst, std::abs(static_cast<double>(within) - exact));
            }
        }
    }
    RecordProperty("worst_within_units_of_2_to_minus_24", std::to_string(worst * 0x1p24));
    EXPECT_LE(worst, WITHIN_TOLERANCE);
}

/// On a CPU the guided draws are those of blocks of samples (draw_blocks), the plain ones are drawn each by itself.
TEST_F(Stage3Sample, GuidedAndPlainSearchesDrawTheSameSamples) {
    const auto maps = {random_map(257, 89, 7), random_map(1, 37, 7), sun_map(8192, 2, 0, 16, 1e9F, 0.05F, true),
                       lone_texel_map(64, 32, 31, 63), checkerboard_map(128, 64)};
    for (const RadianceMap& map : maps) {
        const auto copy = [&] {
            return make_map(map.width, map.height, [&](std::size_t i, std::size_t j) {
                const float* texel = map.rgb.data() + 3 * (i * map.width + j);
                return std::array<float, 3>{texel[0], texel[1], texel[2]};
            });
        };
        LitMap guided(device_, copy());
        LitMap searched(device_, copy(), {}, Search::plain);
        const std::vector<cl_uint> points = points_at_ends(guided.tables());
        EXPECT_EQ(guided.sampler.locate(points).texel, searched.sampler.locate(points).texel);
        constexpr std::size_t COUNT = 100001;
        const SampleSet in_blocks = guided.sampler.draw(COUNT);
        const SampleSet one_by_one = searched.sampler.draw(COUNT);
        EXPECT_EQ(in_blocks.texel.download(), one_by_one.texel.download());
        EXPECT_EQ(in_blocks.direction.download(), one_by_one.direction.download());
        EXPECT_EQ(in_blocks.pdf.download(), one_by_one.pdf.download());
        EXPECT_EQ(in_blocks.radiance.download(), one_by_one.radiance.download());
    }
}

/// The fractions of `count` points of the random sequence's shared stream.
std::vector<cl_uint> random_fractions(std::size_t count, std::uint64_t seed) {
    std::vector<cl_uint> points;
    for (std::size_t k = 0; 2 * k < count; ++k) {
        const auto words = reference::philox4x32_10({static_cast<cl_uint>(k), 0, DOMAIN_SHARED, 0},
                                                    {static_cast<cl_uint>(seed), static_cast<cl_uint>(seed >> 32)});
        points.insert(points.end(), words.begin(), words.end());
    }
    points.resize(2 * count);
    return points;
}

struct Errors {
    double direction = 0;
    double length = 0;
    double pdf_ulp = 0;
};

void check_draws(LitMap& lit, const SamplingOptions& options, std::size_t count, Errors& worst) {
    const SampleSet set = lit.sampler.draw(count);
    const auto texel = set.texel.download();
    const auto direction = set.direction.download();
    const auto pdf = set.pdf.download();
    const auto radiance = set.radiance.download();
    const std::vector<cl_uint> points = random_fractions(count, options.seed);
    const std::vector<cl_float> within = lit.sampler.locate(points).within;
    const long double rotation = static_cast<long double>(options.rotate_y_deg) * std::numbers::pi_v<long double> / 180;
    const auto width = static_cast<long double>(lit.map.width);
    for (std::size_t k = 0; k < count; ++k) {
        const reference::Drawn wanted = reference::draw(lit.tables(), points[2 * k], points[2 * k + 1]);
        ASSERT_EQ(texel[k], wanted.row * lit.map.width + wanted.column) << "sample " << k;
        const long double theta = reference::theta_in_row(wanted.row, lit.map.height, within[2 * k]);
        const long double phi =
            2 * std::numbers::pi_v<long double> * (static_cast<long double>(wanted.column) + within[2 * k + 1]) / width;
        const reference::Vector exact = reference::direction(theta, phi, rotation);
        double length = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const auto component = static_cast<double>(direction[c * count + k]);
            worst.direction = std::max(worst.direction, std::abs(component - static_cast<double>(exact[c])));
            length += component * component;
            ASSERT_EQ(radiance[c * count + k], lit.map.rgb[3 * texel[k] + c]) << "sample " << k;
        }
        worst.length = std::max(worst.length, std::abs(std::sqrt(length) - 1));
        const long double ulp = std::ldexp(1.0L, std::ilogb(wanted.pdf) - 23);
        worst.pdf_ulp =
            std::max(worst.pdf_ulp, static_cast<double>(std::abs(static_cast<long double>(pdf[k]) - wanted.pdf) / ulp));
    }
}

TEST_F(Stage3Sample, DirectionsAndDensitiesAreWithinTheirStatedErrors) {
    for (const double degrees : {0.0, 123.456}) {
        Errors worst;
        SamplingOptions options;
        options.seed = 0x123456789ABCDEF;
        options.rotate_y_deg = degrees;
        for (const auto& [width, height] :
             {std::pair<std::size_t, std::size_t>{1, 1}, {3, 2}, {257, 89}, {8191, 3}, {64, 2001}}) {
            LitMap lit(device_, random_map(width, height, 5), options);
            check_draws(lit, options, 20001, worst);
        }
        const std::string suffix = degrees == 0 ? "_unrotated" : "_rotated";
        RecordProperty("direction" + suffix, std::to_string(worst.direction * 1e7) + "e-7");
        RecordProperty("length" + suffix, std::to_string(worst.length * 1e7) + "e-7");
        RecordProperty("pdf_ulp" + suffix, std::to_string(worst.pdf_ulp));
        EXPECT_LE(worst.direction, DIRECTION_TOLERANCE);
        EXPECT_LE(worst.pdf_ulp, PDF_ULP);
    }
}

TEST_F(Stage3Sample, CentredSamplesLieAtTheirTexelsCentre) {
    SamplingOptions options;
    options.place = TexelPlace::centre;
    options.rotate_y_deg = -30;
    LitMap lit(device_, random_map(257, 89, 5), options);
    const SampleSet set = lit.sampler.draw(1000);
    const auto texel = set.texel.download();
    const auto direction = set.direction.download();
    for (std::size_t k = 0; k < set.count; ++k) {
        const std::size_t row = texel[k] / 257;
        const long double phi =
            2 * std::numbers::pi_v<long double> * (static_cast<long double>(texel[k] % 257) + 0.5L) / 257;
        const reference::Vector exact =
            reference::direction(reference::theta_in_row(row, 89, 0.5L), phi, -std::numbers::pi_v<long double> / 6);
        for (std::size_t c = 0; c < 3; ++c) {
            ASSERT_NEAR(direction[c * set.count + k], static_cast<double>(exact[c]), DIRECTION_TOLERANCE) << k;
        }
    }
}

struct FrequencyCase {
    std::string name;
    std::function<RadianceMap()> make;
};

class Stage3SampleFrequency : public testing::TestWithParam<FrequencyCase> {};

/// Ten million draws: each texel as often as its probability says, and no black one ever.
TEST_P(Stage3SampleFrequency, TexelsAreDrawnAsOftenAsTheirProbabilitySays) {
    constexpr std::size_t DRAWS = 10'000'000;
    const TestDevice device;
    SamplingOptions options;
    options.seed = 20;
    LitMap lit(device, GetParam().make(), options);
    std::vector<std::uint64_t> counts(lit.map.width * lit.map.height, 0);
    for (const cl_uint texel : lit.sampler.draw(DRAWS).texel.download()) ++counts.at(texel);
    const ChiSquare fit = chi_square(counts, texel_probabilities(lit.distribution));
    EXPECT_EQ(fit.impossible, 0U);
    EXPECT_LE(fit.sigmas, CHI_SQUARE_SIGMAS) << fit.classes << " classes";
    RecordProperty("sigmas", std::to_string(fit.sigmas));
}

RadianceMap bundled(std::size_t which) { return std::move(bundled_maps().at(which).second); }

INSTANTIATE_TEST_SUITE_P(
    Maps, Stage3SampleFrequency,
    testing::Values(FrequencyCase{"OneTexel", [] { return constant_map(1, 1, 1); }},
                    FrequencyCase{"Constant", [] { return constant_map(511, 511, 1); }},
                    FrequencyCase{"Random", [] { return random_map(257, 89, 7); }},
                    FrequencyCase{"Checkerboard", [] { return checkerboard_map(128, 64); }},
                    FrequencyCase{"SunsInAnEightKRow", [] { return sun_map(8192, 2, 0, 16, 1e6F, 0.05F, true); }},
                    FrequencyCase{"ModestSun", [] { return sun_map(1024, 64, 20, 16, 1e3F, 0.05F, false); }},
                    FrequencyCase{"PrimeWidth", [] { return random_map(65537, 2, 7); }},
                    FrequencyCase{"Denormal", [] { return constant_map(64, 32, 1e-40F); }},
                    FrequencyCase{"LonePole", [] { return lone_texel_map(64, 32, 0, 63); }},
                    FrequencyCase{"City", [] { return bundled(0); }},
                    FrequencyCase{"Interior", [] { return bundled(1); }},
                    FrequencyCase{"Sunset", [] { return bundled(2); }}),
    [](const auto& each) { return each.param.name; });

/// Any part of the stream is the same draws, whichever call made them, on any threads and in any groups.
TEST_F(Stage3Sample, DrawsDependOnTheirIndexAlone) {
    constexpr std::size_t COUNT = 5001;
    constexpr std::size_t SKIPPED = 1234;
    const auto texels = [](const Device& device, std::size_t first) {
        LitMap lit(device, random_map(257, 89, 5));
        return lit.sampler.draw(COUNT - first, first).texel.download();
    };
    const std::vector<cl_uint> whole = texels(device_, 0);
    const std::vector<cl_uint> later(whole.begin() + SKIPPED, whole.end());
    EXPECT_EQ(texels(device_, SKIPPED), later);
    EXPECT_EQ(texels(TestDevice(DeviceOptions{"", threads_where_possible(1), 0}), 0), whole);
    for (const std::size_t group : {1U, 3U, 64U}) {
        const TestDevice grouped(DeviceOptions{"", 0, group});
        EXPECT_EQ(texels(grouped, 0), whole) << "groups of " << group;
    }
}

/// Large sets are written past the caches, by whole lines where the planes allow it: an aligned set, one whose last
/// block is cut short, and one whose planes lie beside lines.
TEST_F(Stage3Sample, LargeSetsEqualTheirPartsDrawnAloneToTheBit) {
    constexpr std::size_t PART = 100'000;
    LitMap lit(device_, random_map(37, 19, 3));
    for (const std::size_t count : {std::size_t{1} << 18, (std::size_t{1} << 18) + 48, (std::size_t{1} << 18) + 7}) {
        const SampleSet whole = lit.sampler.draw(count);
        const auto texel = whole.texel.download();
        const auto direction = whole.direction.download();
        const auto pdf = whole.pdf.download();
        const auto radiance = whole.radiance.download();
        for (std::size_t first = 0; first < count; first += PART) {
            const std::size_t here = std::min(PART, count - first);
            const SampleSet part = lit.sampler.draw(here, first, count);
            const auto same = [&](const auto& all, const auto& some) {
                const std::size_t planes = all.size() / count;
                for (std::size_t plane = 0; plane < planes; ++plane) {
                    const auto* from = all.data() + plane * count + first;
                    if (std::memcmp(from, some.data() + plane * here, here * sizeof(*from)) != 0) return false;
                }
                return true;
            };
            EXPECT_TRUE(same(texel, part.texel.download())) << count << " from " << first;
            EXPECT_TRUE(same(direction, part.direction.download())) << count << " from " << first;
            EXPECT_TRUE(same(pdf, part.pdf.download())) << count << " from " << first;
            EXPECT_TRUE(same(radiance, part.radiance.download())) << count << " from " << first;
        }
    }
}

TEST_F(Stage3Sample, ABlackMapIsRefused) {
    const RadianceMap map = constant_map(4, 2, 0);
    const DeviceMap on_device(device_, map);
    const Distribution distribution = TableBuilder(device_).build(on_device);
    EXPECT_THROW(Sampler(device_, on_device, distribution, {}), InputError);
}

}  // namespace
}  // namespace clerestory
