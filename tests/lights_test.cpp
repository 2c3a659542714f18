#include "shading/stage4_shade.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "reference/harmonic.hpp"
#include "reference/shade.hpp"
#include "shading/harmonic.hpp"
#include "shading/legendre.hpp"
#include "shading/pixels.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

using test::TestDevice;

using reference::Light;
using reference::Vector;

// A cosine in float32 is off by 3 roundings, weights by one; sums of blocks add a few: of the brightest pixel.
constexpr double SUM_TOLERANCE = 1e-6;
/// Of the weights' sum and a function's largest value: sixteen roundings of weights, directions and sums, and two a
/// step of the recurrence, which takes l / 2 of them; at a pole they are worst.
double projection_tolerance(unsigned l) { return (16 + l) * 0x1p-24; }

Vector unit(const Vector& v) {
    const long double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    return {v[0] / length, v[1] / length, v[2] / length};
}

/// Directions all over the sphere with weights of any colour; reproducible.
std::vector<Light> scattered_lights(std::size_t count, unsigned seed) {
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> weight(0, 1);
    std::vector<Light> lights;
    for (std::size_t i = 0; i < count; ++i) {
        lights.push_back(
            {unit({normal(engine), normal(engine), normal(engine)}), {weight(engine), weight(engine), weight(engine)}});
    }
    return lights;
}

/// Lights as the device holds them; rounded as they are there.
struct Uploaded {
    Uploaded(const Device& device, std::vector<Light>& rounded) : lights(device, rounded.size()) {
        std::vector<float> planes(lights.planes.size(), 0.0F);
        for (std::size_t i = 0; i < rounded.size(); ++i) {
            for (std::size_t c = 0; c < 3; ++c) {
                const auto put = [&](std::size_t plane, long double& value) {
                    planes[plane * lights.stride + i] = static_cast<float>(value);
                    value = static_cast<long double>(planes[plane * lights.stride + i]);
                };
                put(c, rounded[i].direction[c]);
                put(3 + c, rounded[i].radiance[c]);
            }
        }
        lights.planes.upload(planes);
    }
    LightBuffer lights;
};

/// Largest difference of pixels from the reference, over the reference's largest pixel.
double worst_error(const SphereView& view, const std::vector<float>& unit_albedo_radiance,
                   const std::vector<Light>& lights) {
    const auto normals = view.normal.download();
    long double worst = 0;
    long double largest = 0;
    for (std::size_t at = 0; at < view.count; ++at) {
        const Vector exact =
            reference::shade({normals[at], normals[view.stride + at], normals[2 * view.stride + at]}, lights);
        for (std::size_t c = 0; c < 3; ++c) {
            worst = std::max(worst,
                             std::abs(static_cast<long double>(unit_albedo_radiance[c * view.stride + at]) - exact[c]));
            largest = std::max(largest, exact[c]);
        }
    }
    return static_cast<double>(worst / largest);
}

class LightsTest : public testing::Test {
  protected:
    TestDevice device_;
    LightShader shader_{device_};

    std::vector<float> shaded(const SphereView& view, const LightBuffer& lights) {
        Buffer<cl_float> unit_albedo_radiance = view.planes(device_);
        shader_.shade(view, lights, false, unit_albedo_radiance);
        return unit_albedo_radiance.download();
    }
};

/// Sizes at which a group's cone is the whole sphere, half of it, and small; counts about a register and a block.
TEST_F(LightsTest, GroupsGiveThePixelByPixelSum) {
    for (const std::size_t size : {1U, 2U, 16U, 47U, 130U}) {
        const SphereView view(device_, size);
        for (const std::size_t count : {1U, 15U, 16U, 17U, 255U, 257U, 600U}) {
            auto lights = scattered_lights(count, 5);
            const Uploaded uploaded(device_, lights);
            EXPECT_LT(worst_error(view, shaded(view, uploaded.lights), lights), SUM_TOLERANCE)
                << size << " pixels, " << count << " lights";
        }
    }
}

/// Lights about the very horizons of the groups' cones, where a light changes from all to some to none of the pixels.
TEST_F(LightsTest, NoLightIsLostAtTheEdgesOfCones) {
    const SphereView view(device_, 130);
    const auto cones = view.cone.download();
    for (const double beyond : {-1e-3, -1e-5, -4e-6, -1e-6, 0.0, 1e-6, 4e-6, 1e-5, 1e-3}) {
        std::vector<Light> lights;
        for (std::size_t g = 0; g < cones.size(); g += 4) {
            const Vector axis = {cones[g], cones[g + 1], cones[g + 2]};
            const Vector aside = unit({axis[2], 0, -axis[0]});
            for (const double side : {-1.0, 1.0}) {
                const auto sine = static_cast<long double>(side * (static_cast<double>(cones[g + 3]) + beyond));
                if (std::abs(sine) >= 1) continue;
                const long double cosine = std::sqrt(1 - sine * sine);
                lights.push_back({unit({sine * axis[0] + cosine * aside[0], sine * axis[1] + cosine * aside[1],
                                        sine * axis[2] + cosine * aside[2]}),
                                  {1, 0.5L, 0.25L}});
            }
        }
        const Uploaded uploaded(device_, lights);
        EXPECT_LT(worst_error(view, shaded(view, uploaded.lights), lights), SUM_TOLERANCE) << beyond;
    }
}

TEST_F(LightsTest, ConesHoldTheirNormalsAndAreNarrow) {
    const SphereView view(device_, 511);
    const auto normals = view.normal.download();
    const auto cones = view.cone.download();
    double sum = 0;
    for (std::size_t at = 0; at < view.count; ++at) {
        const std::size_t cone = 4 * (at / SphereView::GROUP_PIXELS);
        double cosine = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            cosine += static_cast<double>(cones[cone + c]) * static_cast<double>(normals[c * view.stride + at]);
        }
        const auto sine = static_cast<double>(cones[cone + 3]);
        ASSERT_LE(1 - cosine * cosine, sine * sine) << at;
        sum += sine;
    }
    // A group covers 256 of 205,000 pixels: a square of them has a half diagonal of 0.044 radii, tilted ones more.
    EXPECT_LT(sum / static_cast<double>(view.count), 0.12);
}

TEST_F(LightsTest, EveryPairAgrees) {
    const SphereView view(device_, 47);
    auto lights = scattered_lights(300, 8);
    const Uploaded uploaded(device_, lights);
    Buffer<cl_float> unit_albedo_radiance = view.planes(device_);
    LightShader(device_, true).shade(view, uploaded.lights, false, unit_albedo_radiance);
    EXPECT_LT(worst_error(view, unit_albedo_radiance.download(), lights), SUM_TOLERANCE);
}

/// The width of registers that accelerators have.
TEST_F(LightsTest, RegistersOfOnePixelAgree) {
    constexpr std::size_t REGISTERS = 4;
    const SphereView view(device_, 47);
    auto lights = scattered_lights(300, 8);
    const Uploaded uploaded(device_, lights);
    const Program program(device_, "stage4_shade.cl", "-DPIXELS_WIDE=1 -DREGISTERS=" + std::to_string(REGISTERS));
    Kernel<Floats, Floats, cl_uint, cl_uint, cl_uint, cl_uint, cl_uint, Floats> shade_shared(device_, program,
                                                                                             "shade_shared");
    Buffer<cl_float> unit_albedo_radiance = view.planes(device_);
    const std::size_t items = view.stride / REGISTERS;
    shade_shared({items, 1}, view.normal, uploaded.lights.planes, narrow(uploaded.lights.count),
                 narrow(uploaded.lights.stride), narrow(view.stride), narrow(items), 0U, unit_albedo_radiance);
    EXPECT_LT(worst_error(view, unit_albedo_radiance.download(), lights), SUM_TOLERANCE);
}

TEST_F(LightsTest, HarmonicsOfLightsAreTheReferences) {
    HarmonicShader harmonics(device_);
    for (const std::size_t count : {1U, 17U, 256U, 700U}) {
        auto lights = scattered_lights(count, 3);
        lights[0].direction = {0, 1, 0};  // a pole, where the azimuth means nothing
        const Uploaded uploaded(device_, lights);
        Vector weights{};
        for (const Light& light : lights) {
            for (std::size_t c = 0; c < 3; ++c) weights[c] += light.radiance[c];
        }
        for (const unsigned degree : {0U, 1U, 8U, 13U, 40U}) {
            HarmonicCoefficients got;
            harmonics.project(uploaded.lights, degree, got);
            const auto expected = reference::harmonic_coefficients(lights, degree);
            ASSERT_EQ(got.size(), expected.size());
            for (unsigned l = 0; l <= degree; l += l < 2 ? 1 : 2) {
                for (unsigned m = 0; m <= l; ++m) {
                    for (std::size_t k = 0; k < 6; ++k) {
                        const std::size_t at = triangle_index(l, m);
                        // A function of degree l reaches sqrt((2 l + 1) / (4 pi)).
                        ASSERT_NEAR(got[at][k], expected[at][k],
                                    projection_tolerance(l) * static_cast<double>(weights[k % 3]) *
                                        std::sqrt((2 * l + 1) * std::numbers::pi / 4))
                            << count << " lights, l " << l << " m " << m << " part " << k;
                    }
                }
            }
        }
    }
}

}  // namespace
}  // namespace clerestory
