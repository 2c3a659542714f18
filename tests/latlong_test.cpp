#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cl/program.hpp"
#include "lit_map.hpp"
#include "map/latlong.hpp"
#include "maps.hpp"
#include "sampling/stage3_sample.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

using namespace test;

constexpr double PI = std::numbers::pi;
// A direction is off by 6.5e-7 at most (tests/stage3_sample_test.cpp).
constexpr double DIRECTION_TOLERANCE = 1e-6;
// The argument's product with 2 pi and the series' few roundings of 2^-24, of values up to one.
constexpr double COS_SIN_TOLERANCE = 2e-7;

/// Theta from +y and phi of a direction, the contract's sentence read backwards.
std::pair<double, double> angles_of(const std::array<double, 3>& w) {
    const double phi = std::atan2(w[2], w[0]);
    return {std::atan2(std::hypot(w[0], w[2]), w[1]), phi < 0 ? phi + 2 * PI : phi};
}

struct Directions {
    std::vector<float> planes;
    std::size_t count;
    [[nodiscard]] std::array<double, 3> operator[](std::size_t k) const {
        return {planes[k], planes[count + k], planes[2 * count + k]};
    }
};

class LatLong : public testing::Test {
  protected:
    TestDevice device_;
};

/// Row 0 is up, columns run from +x through +z: each draw of six coloured blocks lies in the block of its colour.
TEST_F(LatLong, EachColouredBlockLiesWhereTheConventionSays) {
    constexpr std::size_t COUNT = 20000;
    LitMap lit(device_, block_map(96, 48));
    const SampleSet set = lit.sampler.draw(COUNT);
    const Directions directions{set.direction.download(), COUNT};
    const auto radiance = set.radiance.download();
    constexpr std::array<std::array<float, 3>, 6> COLOURS = {
        {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}, {1, 1, 0}}};
    std::array<std::size_t, 6> met{};
    for (std::size_t k = 0; k < COUNT; ++k) {
        const auto [theta, phi] = angles_of(directions[k]);
        const double third = phi / (2 * PI / 3);
        if (std::abs(theta - PI / 2) < DIRECTION_TOLERANCE ||
            std::abs(third - std::round(third)) < DIRECTION_TOLERANCE) {
            continue;  // on the edge between two blocks, within the direction's own error
        }
        const std::size_t block = (theta < PI / 2 ? 0 : 3) + static_cast<std::size_t>(third);
        const std::array<float, 3> found = {radiance[k], radiance[COUNT + k], radiance[2 * COUNT + k]};
        ASSERT_EQ(found, COLOURS.at(block)) << "theta " << theta << " phi " << phi;
        ++met.at(block);
    }
    for (const std::size_t count : met) EXPECT_GT(count, COUNT / 20);
}

/// The angle is added to phi. With 90 degrees the centre column lies at -z, in front of the viewer's back.
TEST_F(LatLong, RotationByNinetyDegreesPutsTheCentreColumnAtMinusZ) {
    struct Case {
        double degrees;
        std::array<double, 3> wanted;
    };
    for (const Case& c : {Case{0, {-1, 0, 0}}, Case{90, {0, 0, -1}}, Case{-90, {0, 0, 1}}, Case{450, {0, 0, -1}},
                          Case{180, {1, 0, 0}}}) {
        SamplingOptions options;
        options.place = TexelPlace::centre;
        options.rotate_y_deg = c.degrees;
        LitMap lit(device_, lone_texel_map(3, 1, 0, 1), options);
        const SampleSet set = lit.sampler.draw(2);
        const Directions directions{set.direction.download(), 2};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            EXPECT_NEAR(directions[0][axis], c.wanted[axis], DIRECTION_TOLERANCE)
                << c.degrees << " degrees, axis " << axis;
        }
    }
}

/// Centres of texels of a ramp: a shift of half a texel in any axis would show.
TEST_F(LatLong, TexelCentresLieHalfATexelIn) {
    SamplingOptions options;
    options.place = TexelPlace::centre;
    LitMap lit(device_, ramp_map(96, 48), options);
    constexpr std::size_t COUNT = 5000;
    const SampleSet set = lit.sampler.draw(COUNT);
    const Directions directions{set.direction.download(), COUNT};
    const auto texel = set.texel.download();
    for (std::size_t k = 0; k < COUNT; ++k) {
        const auto row = static_cast<double>(texel[k] / 96);
        const auto column = static_cast<double>(texel[k] % 96);
        const auto [theta, phi] = angles_of(directions[k]);
        // The middle of a row in cos(theta), as samples are spread.
        const double middle = std::acos((std::cos(PI * row / 48) + std::cos(PI * (row + 1) / 48)) / 2);
        ASSERT_NEAR(theta, middle, 2 * DIRECTION_TOLERANCE) << "row " << row;
        // Near a pole an error of the direction turns phi by its inverse sine.
        ASSERT_NEAR(phi, 2 * PI * (column + 0.5) / 96, DIRECTION_TOLERANCE / std::sin(middle)) << "column " << column;
    }
}

/// Theta is taken from the nearer pole, so rows as far from either have the same sine, edge and solid angle to the bit.
TEST_F(LatLong, MirroredRowsAreEqualToTheBit) {
    for (const std::size_t height : {1U, 2U, 3U, 89U, 512U, 8192U}) {
        const RowGeometry geometry = row_geometry(16, height);
        for (std::size_t i = 0; i < height; ++i) {
            const std::size_t mirrored = height - 1 - i;
            const RowFrame& north = geometry.frames[i];
            const RowFrame& south = geometry.frames[mirrored];
            ASSERT_EQ(geometry.sine[i], geometry.sine[mirrored]) << height << " rows, row " << i;
            ASSERT_EQ(north.cap, south.cap);
            ASSERT_EQ(north.cap_step, south.cap_step);
            ASSERT_EQ(north.solid_angle, south.solid_angle);
            if (i != mirrored) {
                ASSERT_EQ(north.pole, -south.pole);
            }
        }
    }
}

/// Rows' values are rounded once from double: half an ulp, and double's own error, which a quarter of it covers.
TEST_F(LatLong, RowsAreWithinAnUlpOfTheirSineAndSolidAngle) {
    constexpr double ULP = 0.5 + 0x1p-20;
    for (const std::size_t height : {1U, 2U, 89U, 512U, 8192U}) {
        const RowGeometry geometry = row_geometry(16, height);
        for (std::size_t i = 0; i < height; ++i) {
            const auto ulps = [](float found, long double exact) {
                return static_cast<double>(std::abs(static_cast<long double>(found) - exact) /
                                           std::ldexp(1.0L, std::ilogb(exact) - 23));
            };
            const long double sine = std::sin(std::numbers::pi_v<long double> *
                                              (static_cast<long double>(std::min(i, height - 1 - i)) + 0.5L) /
                                              static_cast<long double>(height));
            ASSERT_LE(ulps(geometry.sine[i], sine), ULP) << height << " rows, row " << i;
            ASSERT_LE(ulps(geometry.frames[i].solid_angle, reference::solid_angle(i, 16, height)), ULP)
                << height << ' ' << i;
        }
    }
}

TEST_F(LatLong, CosineAndSineOfTurnsAreWithinTheirStatedError) {
    constexpr std::size_t COUNT = 1 << 20;
    const std::string source = assembled_source("latlong.clh") +
                               "kernel void turn(global float* out) {\n"
                               "    const uint at = get_global_id(0);\n"
                               "    const Azimuth cs = cos_sin_turns(at * 0x1p-19f);\n"
                               "    out[2 * at] = cs.cosine;\n"
                               "    out[2 * at + 1] = cs.sine;\n"
                               "}\n";
    cl::Program program(device_.context(), "#pragma OPENCL FP_CONTRACT OFF\n" + source);
    program.build(device_.handle(), "-cl-std=CL1.2");
    cl::Kernel kernel(program, "turn");
    const Buffer<cl_float> out(device_, "cosines and sines", 2 * COUNT);
    kernel.setArg(0, out.handle());
    device_.queue().enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(COUNT), cl::NDRange(64));
    const auto found = out.download();
    double worst = 0;
    for (std::size_t at = 0; at < COUNT; ++at) {
        const double angle = 2 * PI * std::ldexp(static_cast<double>(at), -19);
        worst =
            std::max({worst, std::abs(found[2 * at] - std::cos(angle)), std::abs(found[2 * at + 1] - std::sin(angle))});
    }
    RecordProperty("worst", std::to_string(worst * 1e7) + "e-7");
    EXPECT_LE(worst, COS_SIN_TOLERANCE);
    for (const std::size_t quarter : {0U, 1U, 2U, 3U, 4U, 5U, 6U, 7U}) {
        const std::size_t at = quarter * (COUNT / 8);
        EXPECT_EQ(std::abs(found[2 * at]), quarter % 2 == 0 ? 1 : 0) << "an axis is an axis, exactly";
        EXPECT_EQ(std::abs(found[2 * at + 1]), quarter % 2 == 0 ? 0 : 1);
    }
}

}  // namespace
}  // namespace clerestory
