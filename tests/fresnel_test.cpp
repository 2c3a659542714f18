#include "fresnel/fresnel.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "error.hpp"
#include "fresnel/reflectance.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

using test::TestDevice;

constexpr double NEARLY_ONE = 1e-7;  // the media's difference at which textbook formulas lose every digit of a float
const std::vector<double> RATIOS = {
    1, 1 + NEARLY_ONE, 1 - NEARLY_ONE, 1 / (1 + NEARLY_ONE), 1.5, 1 / 1.5, 2.42, 1 / 2.42, 4, 0.25, 1.333, 1 / 1.333};

/// The contract's bound for curves.
constexpr double MAX_ULP = 4;

/// Rounding of an amplitude in the reference: two products, a difference, a quotient and the cosines, each a rounding
/// or two of 2^-64 relative to a term of at most 1. It shows only beside Brewster's angle, where the amplitude itself
/// is smaller than 1e-12.
constexpr long double REFERENCE_AMPLITUDE_ERROR = 16 * 0x1p-64L;

double ulp_of(long double value) {
    const auto rounded = static_cast<float>(std::abs(value));
    return static_cast<double>(std::nextafter(rounded, std::numeric_limits<float>::infinity())) -
           static_cast<double>(rounded);
}

/// Distance of `value` from the reference in ulps, less what the reference itself may be off by.
double ulps_from(float value, long double reference) {
    const long double own =
        2 * std::sqrt(reference) * REFERENCE_AMPLITUDE_ERROR + REFERENCE_AMPLITUDE_ERROR * REFERENCE_AMPLITUDE_ERROR;
    const long double distance = std::abs(static_cast<long double>(value) - reference);
    return static_cast<double>(std::max(0.0L, distance - own)) / ulp_of(reference);
}

/// 0 to 90 in small steps, and Brewster's and the critical angle with their neighbours in float and in double.
std::vector<double> hard_angles(const Media& media) {
    constexpr unsigned STEPS = 9001;  // a hundredth of a degree
    auto angles = incidence_angles(STEPS);
    const auto facts = fresnel_facts(media);
    std::vector<double> special = {facts.brewster_deg, 90, 0};
    if (facts.critical_deg) special.push_back(*facts.critical_deg);
    for (const double angle : special) {
        const auto single = static_cast<float>(angle);
        for (const double end : {0.0, 90.0}) {
            angles.push_back(std::nextafter(angle, end));
            angles.push_back(static_cast<double>(std::nextafter(single, static_cast<float>(end))));
        }
        angles.push_back(angle);
        angles.push_back(std::min(90.0, static_cast<double>(single)));
    }
    return angles;
}

class Fresnel : public testing::TestWithParam<FresnelArithmetic> {
  protected:
    TestDevice device_;
};

INSTANTIATE_TEST_SUITE_P(Arithmetic, Fresnel, testing::Values(FresnelArithmetic::fp64, FresnelArithmetic::float_pairs),
                         [](const auto& info) {
                             return info.param == FresnelArithmetic::fp64 ? "Fp64" : "FloatPairs";
                         });

TEST_P(Fresnel, CurvesAreWithinFourUlpOfTheLongDoubleReference) {
    double worst = 0;
    for (const double ratio : RATIOS) {
        for (const auto& media : {Media{1, ratio}, Media{ratio, 1}}) {
            const auto curves = fresnel_curves(device_, media, hard_angles(media), GetParam());
            for (std::size_t i = 0; i < curves.angle_deg.size(); ++i) {
                const auto expected = reflectance(media.ior_incident, media.ior_transmitted, curves.angle_deg[i]);
                const double ulps = std::max({ulps_from(curves.parallel[i], expected.parallel),
                                              ulps_from(curves.perpendicular[i], expected.perpendicular),
                                              ulps_from(curves.mean[i], expected.mean),
                                              ulps_from(curves.schlick[i], expected.schlick)});
                worst = std::max(worst, ulps);
                EXPECT_LE(ulps, MAX_ULP) << media.ior_incident << " to " << media.ior_transmitted << " at "
                                         << curves.angle_deg[i] << " degrees: " << curves.parallel[i] << " "
                                         << curves.perpendicular[i] << " " << curves.mean[i] << " " << curves.schlick[i]
                                         << " for " << expected.parallel << " " << expected.perpendicular << " "
                                         << expected.mean << " " << expected.schlick;
            }
        }
    }
    RecordProperty("worst_ulp", std::to_string(worst));
}

TEST_P(Fresnel, EqualMediaReflectNothingBelowGrazingIncidence) {
    const auto curves = fresnel_curves(device_, {1.5, 1.5}, hard_angles({1.5, 1.5}), GetParam());
    for (std::size_t i = 0; i < curves.angle_deg.size(); ++i) {
        const float expected = curves.angle_deg[i] < 90 ? 0.0F : 1.0F;
        EXPECT_EQ(curves.parallel[i], expected) << curves.angle_deg[i];
        EXPECT_EQ(curves.perpendicular[i], expected) << curves.angle_deg[i];
        EXPECT_EQ(curves.mean[i], expected) << curves.angle_deg[i];
    }
}

TEST_P(Fresnel, EverythingIsReflectedAtAndPastTheCriticalAngle) {
    for (const double ior : {1 + NEARLY_ONE, 1.5, 4.0}) {
        const Media media = {ior, 1};
        const double critical = fresnel_facts(media).critical_deg.value();
        const auto curves = fresnel_curves(
            device_, media, {static_cast<double>(std::nextafter(static_cast<float>(critical), 90.0F)), 89.9999, 90},
            GetParam());
        for (std::size_t i = 0; i < curves.angle_deg.size(); ++i) {
            EXPECT_EQ(curves.parallel[i], 1.0F);
            EXPECT_EQ(curves.perpendicular[i], 1.0F);
            EXPECT_EQ(curves.mean[i], 1.0F);
            EXPECT_EQ(curves.schlick[i], 1.0F);
        }
    }
}

TEST_P(Fresnel, OneFloatUlpBelowTheCriticalAngleSomeLightLeaves) {
    for (const double ior : {1.5, 2.42, 4.0}) {
        const Media media = {ior, 1};
        const auto critical = static_cast<float>(fresnel_facts(media).critical_deg.value());
        const double below = std::nextafter(std::nextafter(critical, 0.0F), 0.0F);
        const auto curves = fresnel_curves(device_, media, {below}, GetParam());
        EXPECT_LT(curves.parallel[0], 1.0F);
        EXPECT_LT(curves.perpendicular[0], 1.0F);
        EXPECT_GT(curves.perpendicular[0], curves.parallel[0]);
    }
}

/// Stokes: the path of light can be reversed, so both sides reflect alike at angles that Snell's law connects.
TEST_P(Fresnel, BothSidesReflectAlikeAlongTheSamePath) {
    constexpr double RADIANS = 0.017453292519943295;
    std::vector<double> outside, inside;
    for (int degrees = 1; degrees < 90; ++degrees) {
        outside.push_back(degrees);
        inside.push_back(std::asin(std::sin(degrees * RADIANS) / 1.5) / RADIANS);
    }
    const auto in = fresnel_curves(device_, {1, 1.5}, outside, GetParam());
    const auto out = fresnel_curves(device_, {1.5, 1}, inside, GetParam());
    for (std::size_t i = 0; i < outside.size(); ++i) {
        // The inner angle is rounded to a double; below 90 degrees the reflectance magnifies that by less than 1e4.
        constexpr double ROUNDED_ANGLE = 1e-6;
        EXPECT_NEAR(in.mean[i], out.mean[i], ROUNDED_ANGLE) << outside[i];
        EXPECT_NEAR(in.schlick[i], out.schlick[i], ROUNDED_ANGLE) << outside[i];
    }
}

TEST(FresnelFacts, GlassFromAirHasItsTextbookAngles) {
    constexpr double PRINTED = 5e-6;  // the issue gives five decimals
    const auto in = fresnel_facts({1, 1.5});
    EXPECT_DOUBLE_EQ(in.r0, 0.04);
    EXPECT_NEAR(in.brewster_deg, 56.30993, PRINTED);
    EXPECT_FALSE(in.critical_deg.has_value());
    const auto out = fresnel_facts({1.5, 1});
    EXPECT_DOUBLE_EQ(out.r0, 0.04);
    EXPECT_NEAR(out.brewster_deg, 90 - 56.30993, PRINTED);
    ASSERT_TRUE(out.critical_deg.has_value());
    EXPECT_NEAR(*out.critical_deg, 41.81031, PRINTED);
}

TEST(FresnelFacts, SchlicksWorstRelativeErrorForGlassIsNearBrewstersAngle) {
    const auto facts = fresnel_facts({1, 1.5});
    EXPECT_NEAR(facts.max_rel.value().error, 0.232, 5e-4);
    EXPECT_NEAR(facts.max_rel.value().angle_deg, 55.5, 0.05);
}

TEST(FresnelFacts, NoAngleOfAFineGridHasALargerSchlickError) {
    for (const double ratio : RATIOS) {
        for (const auto& media : {Media{1, ratio}, Media{ratio, 1}}) {
            const auto facts = fresnel_facts(media);
            for (const double angle : hard_angles(media)) {
                const auto r = reflectance(media.ior_incident, media.ior_transmitted, angle);
                const auto error = static_cast<double>(std::abs(r.schlick - r.mean));
                // A double's rounding of the answer, nothing else.
                constexpr double ROUNDING = 1 + 4e-16;
                EXPECT_LE(error, facts.max_abs.error * ROUNDING) << ratio << " at " << angle;
                if (facts.max_rel && r.mean > 0) {
                    EXPECT_LE(error / static_cast<double>(r.mean), facts.max_rel->error * ROUNDING)
                        << ratio << " at " << angle;
                }
            }
        }
    }
}

TEST(FresnelFacts, EqualMediaHaveNoRelativeErrorAndNoCriticalAngle) {
    const auto facts = fresnel_facts({1.33, 1.33});
    EXPECT_EQ(facts.r0, 0);
    EXPECT_DOUBLE_EQ(facts.brewster_deg, 45);
    EXPECT_FALSE(facts.critical_deg.has_value());
    EXPECT_FALSE(facts.max_rel.has_value());
    EXPECT_EQ(facts.max_abs.error, 1);
}

TEST(FresnelFacts, IndicesThatNoMediumHasAreRefused) {
    for (const double ior : {0.0, -1.5, std::nan(""), HUGE_VAL, -HUGE_VAL, 1e-30, 1e30}) {
        EXPECT_THROW(fresnel_facts({ior, 1.5}), UsageError) << ior;
        EXPECT_THROW(fresnel_facts({1, ior}), UsageError) << ior;
    }
}

TEST(FresnelAngles, RunFromZeroToNinetyAndNeedTwoSteps) {
    const auto angles = incidence_angles(901);
    EXPECT_EQ(angles.front(), 0);
    EXPECT_EQ(angles.back(), 90);
    EXPECT_EQ(angles[450], 45);
    EXPECT_THROW(incidence_angles(0), UsageError);
    EXPECT_THROW(incidence_angles(1), UsageError);
    EXPECT_THROW(incidence_angles(4'000'000'000U), UsageError);
}

}  // namespace
}  // namespace clerestory
