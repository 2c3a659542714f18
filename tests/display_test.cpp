#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "maps.hpp"
#include "reference/display.hpp"
#include "shading/display.hpp"
#include "shading/pixels.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

using namespace test;

// The exposed radiance and the curve's steps are rounded once each: 2 * 2^-24 of the radiance moves the curve by less
// than 1e-4 of a step of 255 at any gamma from 0.2 up, so a byte differs from the rounded curve only where that lies so
// near to a half.
constexpr double TONE_STEPS = 0.5 + 1e-4;
constexpr cl_uint GREEN = 0xFF00FF00;

cl_uint byte_of(cl_uint pixel, std::size_t c) { return pixel >> (8 * c) & 0xFF; }

class DisplayTest : public testing::Test {
  protected:
    TestDevice device_;
    Display display_{device_};
};

TEST_F(DisplayTest, ToneCurveIsWithinItsRounding) {
    std::vector<float> values;
    for (int i = 0; i <= 3 * 4000; ++i) values.push_back(1.1F * static_cast<float>(i) / 12000);
    values.resize(values.size() / 3 * 3);
    for (const ToneOptions& tone :
         {ToneOptions{1, 2.2}, ToneOptions{0.125, 2.2}, ToneOptions{8, 1}, ToneOptions{1e-3, 5}}) {
        const auto preview = display_.preview(values, 3, tone);
        for (std::size_t i = 0; i < values.size(); ++i) {
            const auto exact = static_cast<double>(reference::tone(values[i], tone.exposure, tone.gamma));
            ASSERT_NEAR(byte_of(preview[i / 3], i % 3), exact, TONE_STEPS) << values[i] << " at " << tone.exposure;
        }
    }
}

TEST_F(DisplayTest, ValuesBesideTheCurveBecomeItsEnds) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float inf = std::numeric_limits<float>::infinity();
    const std::vector<float> values = {nan, inf, -inf, -1, -0.0F, 3e38F, 1e-40F, 1, 2};
    const auto preview = display_.preview(values, 3, {1, 2.2});
    EXPECT_EQ(preview[0], 0xFF00FF00U);
    EXPECT_EQ(preview[1], 0xFFFF0000U);
    EXPECT_EQ(preview[2], 0xFFFFFF00U);
    EXPECT_EQ(display_.preview(values, 3, {0, 2.2})[0], 0xFF000000U) << "exposure 0 of infinity is black";
}

/// Alpha is coverage: not exposed, and held to a byte whatever a file says.
TEST_F(DisplayTest, AlphaIsHeldToItsByte) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::vector<float> rgba;
    for (const float alpha : {0.0F, 0.5F, 1.0F, 2.0F, 1e9F, -1.0F, nan}) rgba.insert(rgba.end(), {0, 0, 0, alpha});
    const auto preview = display_.preview(rgba, 4, {8, 2.2});
    const std::vector<cl_uint> wanted = {0, 128, 255, 255, 255, 0, 0};
    for (std::size_t i = 0; i < wanted.size(); ++i) {
        EXPECT_EQ(byte_of(preview[i], 3), wanted[i]) << rgba[4 * i + 3];
        EXPECT_EQ(preview[i] & 0xFFFFFF, 0U) << rgba[4 * i + 3];
    }
}

/// Corners, edges, overlaps; maps smaller than a mark.
TEST_F(DisplayTest, MarksAreFiveWideAndClippedAtTheEdges) {
    for (const auto& [width, height] : {std::pair<std::size_t, std::size_t>{1, 1}, {3, 2}, {1, 9}, {12, 1}, {31, 17}}) {
        const RadianceMap map = constant_map(width, height, 0.25F);
        const auto last = static_cast<cl_uint>(width * height - 1);
        const auto w = static_cast<cl_uint>(width);
        const std::vector<cl_uint> texels = {0, w - 1, last, last + 1 - w, last / 2, last / 2 + (last > 1 ? 1 : 0)};
        for (const std::vector<cl_uint>& marks : {std::vector<cl_uint>{texels[0]}, {texels[1]}, {texels[4]}, texels}) {
            const Buffer<cl_uint> on_device(device_, "marks", std::span<const cl_uint>(marks));
            const auto preview = display_.marked_preview(map, 1, {1, 2.2}, on_device);
            const cl_uint plain = display_.preview({map.rgb.data(), map.rgb.size()}, 3, {1, 2.2})[0];
            const auto wanted = reference::marked(marks, width, height);
            for (std::size_t at = 0; at < preview.size(); ++at) {
                ASSERT_EQ(preview[at], wanted[at] != 0 ? GREEN : plain) << width << 'x' << height << " pixel " << at;
            }
        }
    }
}

TEST_F(DisplayTest, ComposeScalesAndPlacesEveryPixelOfTheSphereOnly) {
    for (const std::size_t size : {1U, 2U, 17U}) {
        const SphereView view(device_, size);
        std::vector<float> planes(3 * view.stride);
        std::iota(planes.begin(), planes.end(), 1.0F);
        const Buffer<cl_float> unit_albedo_radiance(device_, "white", std::span<const cl_float>(planes));
        const auto rgba = display_.compose(view, unit_albedo_radiance, 0.75, 3);
        const auto pixels = view.pixel.download();
        std::vector<float> wanted(4 * size * size, 0.0F);
        for (std::size_t at = 0; at < view.count; ++at) {
            float* to = &wanted[4 * pixels[at]];
            for (std::size_t c = 0; c < 3; ++c) to[c] = 6 * planes[c * view.stride + at];  // 0.75 * 2^3, exact
            to[3] = 1;
        }
        EXPECT_EQ(rgba, wanted) << size;
    }
}

/// Gain and exponent may each leave float32 where the product with the radiance does not.
TEST_F(DisplayTest, ComposeReachesBothEndsOfFloat32) {
    const SphereView view(device_, 1);
    std::vector<float> planes(3 * view.stride, 1.0F);
    const Buffer<cl_float> unit_albedo_radiance(device_, "white", std::span<const cl_float>(planes));
    struct Case {
        double gain;
        int exponent;
        double wanted;
    };
    for (const Case& c : {Case{1, 126, std::ldexp(1, 126)}, Case{1, -126, std::ldexp(1, -126)},
                          Case{std::ldexp(1, 100), -126, std::ldexp(1, -26)},
                          Case{std::ldexp(1, -100), 126, std::ldexp(1, 26)}, Case{0, 126, 0}}) {
        EXPECT_EQ(static_cast<double>(display_.compose(view, unit_albedo_radiance, c.gain, c.exponent)[0]), c.wanted)
            << c.gain;
    }
}

}  // namespace
}  // namespace clerestory
