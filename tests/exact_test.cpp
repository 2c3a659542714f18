#include "shading/exact.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "reference/irradiance.hpp"
#include "shading/pixels.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

using test::TestDevice;

using reference::Vector;

// A result in float32 is off by up to 2^-24 = 6e-8 of itself, and the root mean square of these tests' answers is at
// most 3.2 times their mean (a lone texel's lobe); nothing else is left of the contract's 2e-6.
constexpr double FLOAT32_RMSE = 2e-7;
// The reference stops splitting at this size: its own error is measured below against a finer one.
constexpr double RESOLUTION = 1e-3;
constexpr double RESOLUTION_RMSE = 3e-8;
// One pixel: 2^-24 of a value up to 4, and the sums' rounding in double, which is far less.
constexpr double FLOAT32_PIXEL = 2.5e-7;

RadianceMap map_of(std::size_t width, std::size_t height,
                   const std::function<Vector(std::size_t row, std::size_t column)>& radiance) {
    RadianceMap map{width, height, PageBuffer(3 * width * height)};
    for (std::size_t k = 0; k < width * height; ++k) {
        const Vector rgb = radiance(k / width, k % width);
        for (std::size_t c = 0; c < 3; ++c) map.rgb[3 * k + c] = static_cast<float>(rgb[c]);
    }
    return map;
}

RadianceMap constant_map(std::size_t width, std::size_t height, double value) {
    return map_of(width, height, [=](auto, auto) { return Vector{value, value, value}; });
}

RadianceMap random_map(std::size_t width, std::size_t height, unsigned seed) {
    std::mt19937 bits(seed);
    std::exponential_distribution<double> value;
    return map_of(width, height, [&](auto, auto) { return Vector{value(bits), value(bits), value(bits)}; });
}

RadianceMap lone_texel(std::size_t width, std::size_t height, std::size_t row, std::size_t column) {
    return map_of(width, height, [=](std::size_t i, std::size_t j) {
        return i == row && j == column ? Vector{1, 2, 3} : Vector{};
    });
}

/// Irradiance of every pixel, three channels together, and the normals it belongs to.
struct Lit {
    std::vector<Vector> normal;
    std::vector<Vector> irradiance;
};

Lit exact_irradiance(const Device& device, const RadianceMap& map, double rotate_y_deg, const SphereView& view) {
    const DeviceMap on_device(device, map);
    const Distribution distribution = TableBuilder(device).build(on_device);
    auto unit_albedo_radiance = view.planes(device);
    ExactIntegrator(device).shade(on_device, distribution, rotate_y_deg, view, unit_albedo_radiance);
    const auto normals = view.normal.download();
    const auto values = unit_albedo_radiance.download();
    Lit lit;
    for (std::size_t i = 0; i < view.count; ++i) {
        Vector n{};
        Vector e{};
        for (std::size_t c = 0; c < 3; ++c) {
            n[c] = static_cast<double>(normals[c * view.stride + i]);
            e[c] =
                std::numbers::pi * std::ldexp(static_cast<double>(values[c * view.stride + i]), distribution.exponent);
        }
        // As the kernels have it: n_y as it is, and the length that a unit vector has beside it.
        const double beside = std::sqrt(1 - n[1] * n[1]);
        const double length = std::hypot(n[0], n[2]);
        for (const std::size_t c : {0U, 2U}) n[c] = length > 0 ? n[c] / length * beside : 0;
        lit.normal.push_back(n);
        lit.irradiance.push_back(e);
    }
    return lit;
}

/// Relative RMSE over pixels and channels, over the mean of what is expected.
double relative_rmse(const Lit& lit, const std::function<Vector(const Vector& n)>& expected) {
    double squares = 0;
    double sum = 0;
    for (std::size_t i = 0; i < lit.normal.size(); ++i) {
        const Vector e = expected(lit.normal[i]);
        for (std::size_t c = 0; c < 3; ++c) {
            sum += e[c];
            squares += (lit.irradiance[i][c] - e[c]) * (lit.irradiance[i][c] - e[c]);
        }
    }
    const auto count = static_cast<double>(3 * lit.normal.size());
    return std::sqrt(squares / count) / (sum / count);
}

std::function<Vector(const Vector&)> reference_of(const RadianceMap& map, double rotate_y_deg,
                                                  double resolution = RESOLUTION) {
    return [&map, rotate_y_deg, resolution](const Vector& n) {
        return reference::irradiance(map, rotate_y_deg, n, resolution);
    };
}

/// A view of chosen normals, in place of a sphere's.
SphereView view_of(const Device& device, const std::vector<Vector>& normals) {
    SphereView view(device, 1);
    view.count = normals.size();
    view.stride = (normals.size() + SphereView::GROUP_PIXELS - 1) / SphereView::GROUP_PIXELS * SphereView::GROUP_PIXELS;
    std::vector<cl_float> planes(3 * view.stride, 0.0F);
    for (std::size_t i = 0; i < view.stride; ++i) planes[2 * view.stride + i] = 1;
    for (std::size_t i = 0; i < normals.size(); ++i) {
        for (std::size_t c = 0; c < 3; ++c) planes[c * view.stride + i] = static_cast<float>(normals[i][c]);
    }
    view.normal = Buffer<cl_float>(device, "chosen normals", std::span<const cl_float>(planes));
    view.pixel = Buffer<cl_uint>(device, "chosen pixels", view.stride);
    return view;
}

/// Normals whose horizons run through corners and along edges of small maps: axes, diagonals, and the edges' own tilts.
std::vector<Vector> awkward_normals() {
    std::vector<Vector> normals;
    for (int x = -1; x <= 1; ++x) {
        for (int y = -1; y <= 1; ++y) {
            for (int z = -1; z <= 1; ++z) {
                const double length = std::sqrt(x * x + y * y + z * z);
                if (length > 0) normals.push_back({x / length, y / length, z / length});
            }
        }
    }
    for (int k = 1; k < 12; ++k) {
        const double tilt = std::numbers::pi * k / 12;
        for (int j = 0; j < 12; ++j) {
            const double turn = std::numbers::pi * j / 6;
            normals.push_back({std::sin(tilt) * std::cos(turn), std::cos(tilt), std::sin(tilt) * std::sin(turn)});
        }
    }
    return normals;
}

struct Size {
    std::size_t width, height;
};

std::string name_of(const testing::TestParamInfo<Size>& info) {
    return std::to_string(info.param.width) + "x" + std::to_string(info.param.height);
}

class ExactOfSize : public testing::TestWithParam<Size> {
  protected:
    TestDevice device_;
    SphereView view_{device_, 9};
};

/// Random radiance, at a rotation that is no whole number of columns.
TEST_P(ExactOfSize, RandomMapEqualsTheReference) {
    const auto [width, height] = GetParam();
    const RadianceMap map = random_map(width, height, 7);
    const Lit lit = exact_irradiance(device_, map, 33.3, view_);
    EXPECT_LT(relative_rmse(lit, reference_of(map, 33.3)), FLOAT32_RMSE + RESOLUTION_RMSE);
}

/// Horizons through corners and along edges, where every decision falls on a knife's edge.
TEST_P(ExactOfSize, HorizonsThroughCornersEqualTheReference) {
    const auto [width, height] = GetParam();
    const RadianceMap map = random_map(width, height, 11);
    const Lit lit = exact_irradiance(device_, map, 0, view_of(device_, awkward_normals()));
    EXPECT_LT(relative_rmse(lit, reference_of(map, 0)), FLOAT32_RMSE + RESOLUTION_RMSE);
}

/// Furnace: a surface in a world of radiance 1 shows radiance 1, at every pixel.
TEST_P(ExactOfSize, ConstantMapGivesTheConstant) {
    const auto [width, height] = GetParam();
    const RadianceMap map = constant_map(width, height, 1);
    for (const Vector& e : exact_irradiance(device_, map, 12.5, SphereView(device_, 33)).irradiance) {
        for (const double x : e) ASSERT_NEAR(x / std::numbers::pi, 1, FLOAT32_PIXEL);
    }
}

INSTANTIATE_TEST_SUITE_P(Sizes, ExactOfSize,
                         testing::Values(Size{1, 1}, Size{2, 1}, Size{1, 2}, Size{1, 4}, Size{3, 2}, Size{4, 2},
                                         Size{12, 6}, Size{24, 12}, Size{37, 1}, Size{1, 41}, Size{7, 5}, Size{64, 32},
                                         Size{31, 33}),
                         name_of);

struct Place {
    Size size;
    std::size_t row, column;
};

class ExactOfLoneTexel : public testing::TestWithParam<Place> {};

/// Normals all over the sphere, and as many whose horizons cut a texel of the map.
std::vector<Vector> normals_about(const RadianceMap& map, std::size_t row, std::size_t column) {
    std::mt19937 bits(1);
    std::uniform_real_distribution<double> unit;
    std::vector<Vector> normals;
    for (int k = 0; k < 128; ++k) {
        const double y = 2 * unit(bits) - 1;
        const double turn = 2 * std::numbers::pi * unit(bits);
        const double radius = std::sqrt(1 - y * y);
        Vector n = {radius * std::cos(turn), y, radius * std::sin(turn)};
        if (k % 2 == 1) {
            const double theta =
                std::numbers::pi * (static_cast<double>(row) + unit(bits)) / static_cast<double>(map.height);
            const double phi =
                2 * std::numbers::pi * (static_cast<double>(column) + unit(bits)) / static_cast<double>(map.width);
            const Vector w = {std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
            const double along = n[0] * w[0] + n[1] * w[1] + n[2] * w[2];
            const double length = std::sqrt(1 - along * along);
            for (std::size_t c = 0; c < 3; ++c) n[c] = (n[c] - along * w[c]) / length;
        }
        normals.push_back(n);
    }
    return normals;
}

/// One texel lit, anywhere: the horizon cuts it for half of the normals, the others show its cosine lobe.
TEST_P(ExactOfLoneTexel, EqualsTheReference) {
    const Place place = GetParam();
    const TestDevice device;
    const RadianceMap map = lone_texel(place.size.width, place.size.height, place.row, place.column);
    // A thousand pieces a side: 1e-6 / 24 of the cosine across the texel, which is at most 0.1.
    const double texel = std::numbers::pi / static_cast<double>(std::max(place.size.width / 2, place.size.height));
    const SphereView view = view_of(device, normals_about(map, place.row, place.column));
    const Lit lit = exact_irradiance(device, map, 0, view);
    EXPECT_LT(relative_rmse(lit, reference_of(map, 0, texel / 1024)), FLOAT32_RMSE);
}

INSTANTIATE_TEST_SUITE_P(Places, ExactOfLoneTexel,
                         testing::Values(Place{{64, 32}, 0, 0}, Place{{64, 32}, 31, 63}, Place{{64, 32}, 16, 0},
                                         Place{{64, 32}, 15, 63}, Place{{257, 89}, 44, 31}, Place{{1024, 512}, 0, 1023},
                                         Place{{1024, 512}, 255, 0}, Place{{1024, 512}, 256, 640},
                                         Place{{2048, 1024}, 700, 1000}, Place{{4096, 1}, 0, 17},
                                         Place{{1, 4096}, 2040, 0}),
                         [](const auto& info) {
                             return std::to_string(info.param.size.width) + "x" +
                                    std::to_string(info.param.size.height) + "At" + std::to_string(info.param.row) +
                                    "And" + std::to_string(info.param.column);
                         });

/// A texel wholly above the horizon adds L n . V, one wholly below adds nothing, to the last bit.
TEST(Exact, LoneTexelIsItsCosineLobe) {
    const TestDevice device;
    const std::size_t width = 64;
    const std::size_t height = 32;
    const RadianceMap map = lone_texel(width, height, 9, 20);
    const double step = std::numbers::pi / static_cast<double>(height);
    const Vector v = reference::cell_vector(9 * step, 10 * step, 20 * step, 21 * step);
    const double whole = std::hypot(v[0], v[1], v[2]);
    std::size_t above = 0;
    std::size_t below = 0;
    const Lit lit = exact_irradiance(device, map, 0, SphereView(device, 65));
    for (std::size_t i = 0; i < lit.normal.size(); ++i) {
        const Vector& n = lit.normal[i];
        const double lobe = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
        for (std::size_t c = 0; c < 3; ++c) {
            const double radiance = static_cast<double>(c) + 1;
            if (lobe > 0.2 * whole) {
                ++above;
                EXPECT_NEAR(lit.irradiance[i][c], radiance * lobe, FLOAT32_PIXEL * radiance * lobe);
            } else if (lobe < -0.2 * whole) {
                ++below;
                EXPECT_NEAR(lit.irradiance[i][c], 0, 1e-12 * whole);
            }
        }
    }
    EXPECT_GT(above, 100U);
    EXPECT_GT(below, 100U);
}

/// Suns of 1e6 over a dim sky: what faces away from them still shows the sky, to its own precision.
TEST(Exact, SkyBehindTheSunKeepsItsPrecision) {
    const TestDevice device;
    const RadianceMap map = map_of(256, 128, [](std::size_t i, std::size_t j) {
        const double value = i == 40 && (j == 64 || j == 0 || j == 255) ? 1e6 : 0.05;
        return Vector{value, value, value};
    });
    const Lit lit = exact_irradiance(device, map, 0, view_of(device, {{0, -0.6, -0.8}, {0, -1, 0}}));
    for (const Vector& e : lit.irradiance) {
        // Rounding in double of sums that the suns dominate: 2^-53 times 1e6 over 0.05, times some tens of terms.
        for (const double x : e) EXPECT_NEAR(x / std::numbers::pi, 0.05, 0.05 * (FLOAT32_PIXEL + 1e-7));
    }
}

/// Radiance 1 + y gives 1 + 2/3 n_y: the cosine's first moment.
TEST(Exact, LinearMapGivesTwoThirdsOfTheSlope) {
    const TestDevice device;
    const std::size_t height = 4096;
    const RadianceMap map = map_of(1, height, [=](std::size_t i, std::size_t) {
        const double theta = std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(height);
        const double value = 1 + std::cos(theta);
        return Vector{value, value, value};
    });
    // Steps of radiance: (pi / H)^2 / 24 = 2.5e-8, below float32's rounding.
    const Lit lit = exact_irradiance(device, map, 0, SphereView(device, 65));
    EXPECT_LT(relative_rmse(lit,
                            [](const Vector& n) {
                                const double e = std::numbers::pi * (1 + 2.0 / 3 * n[1]);
                                return Vector{e, e, e};
                            }),
              FLOAT32_RMSE);
}

/// Half a world lit: (1 + cosine with the middle of the lit half) / 2, exactly, whichever half.
TEST(Exact, HalfLitWorldGivesTheClosedForm) {
    const TestDevice device;
    const SphereView view(device, 65);
    const RadianceMap upper = map_of(8, 6, [](std::size_t i, std::size_t) { return Vector{i < 3 ? 1.0 : 0.0, 0, 0}; });
    const RadianceMap front = map_of(8, 6, [](std::size_t, std::size_t j) { return Vector{j < 4 ? 1.0 : 0.0, 0, 0}; });
    const auto half = [](std::size_t axis) {
        return [axis](const Vector& n) { return Vector{std::numbers::pi / 2 * (1 + n[axis]), 0, 0}; };
    };
    EXPECT_LT(relative_rmse(exact_irradiance(device, upper, 0, view), half(1)), FLOAT32_RMSE);
    EXPECT_LT(relative_rmse(exact_irradiance(device, front, 0, view), half(2)), FLOAT32_RMSE);
    // Rotated by 270 degrees, the half around +z lies around +x: x = x_m cos A - z_m sin A.
    EXPECT_LT(relative_rmse(exact_irradiance(device, front, 270, view), half(0)), FLOAT32_RMSE);
}

/// Rotating by whole columns is the same as moving the map's columns on.
TEST(Exact, RotationByColumnsShiftsTheMap) {
    const TestDevice device;
    const SphereView view(device, 33);
    const std::size_t width = 36;
    const RadianceMap map = random_map(width, 18, 3);
    const RadianceMap shifted = map_of(width, 18, [&](std::size_t i, std::size_t j) {
        const float* from = map.rgb.data() + 3 * (i * width + (j + width - 5) % width);
        return Vector{static_cast<double>(from[0]), static_cast<double>(from[1]), static_cast<double>(from[2])};
    });
    const Lit rotated = exact_irradiance(device, map, 50, view);
    const Lit moved = exact_irradiance(device, shifted, 0, view);
    for (std::size_t i = 0; i < rotated.irradiance.size(); ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
            EXPECT_NEAR(rotated.irradiance[i][c], moved.irradiance[i][c], FLOAT32_PIXEL * moved.irradiance[i][c]);
        }
    }
}

/// Work-groups and threads change nothing, not even the last bit.
TEST(Exact, BitsAreTheSameForAnyWorkGroupAndThreads) {
    const RadianceMap map = random_map(67, 41, 5);
    const auto run = [&](const DeviceOptions& options) {
        const TestDevice device(options);
        return exact_irradiance(device, map, 77, SphereView(device, 33)).irradiance;
    };
    const auto expected = run({});
    EXPECT_EQ(run({.selector = "", .threads = test::threads_where_possible(1), .work_group = 0}), expected);
    EXPECT_EQ(run({.selector = "", .threads = 0, .work_group = 1}), expected);
    EXPECT_EQ(run({.selector = "", .threads = 0, .work_group = 48}), expected);
}

/// Maps at the ends of float32 lose nothing: the smallest numbers, and those whose sums overflow.
TEST(Exact, ExtremeRadianceKeepsItsPrecision) {
    const TestDevice device;
    const SphereView view(device, 9);
    for (const double value : {1e-40, 3e38}) {
        const auto stored = static_cast<double>(static_cast<float>(value));
        for (const Vector& e : exact_irradiance(device, constant_map(8, 4, value), 0, view).irradiance) {
            for (const double x : e) EXPECT_NEAR(x / std::numbers::pi / stored, 1, FLOAT32_PIXEL);
        }
    }
}

TEST(Exact, BlackMapGivesZeros) {
    const TestDevice device;
    for (const Vector& e : exact_irradiance(device, constant_map(4, 2, 0), 0, SphereView(device, 9)).irradiance) {
        EXPECT_EQ(e, (Vector{0, 0, 0}));
    }
}

/// Progress grows from launch to launch and ends at the total that was estimated.
TEST(Exact, ProgressEndsAtTheEstimate) {
    const TestDevice device;
    const RadianceMap map = random_map(256, 256, 1);
    const DeviceMap on_device(device, map);
    const Distribution distribution = TableBuilder(device).build(on_device);
    const SphereView view(device, 9);
    auto unit_albedo_radiance = view.planes(device);
    double last = 0;
    double total = 0;
    ExactIntegrator(device).shade(on_device, distribution, 0, view, unit_albedo_radiance, [&](double done, double all) {
        EXPECT_GT(done, last);
        last = done;
        total = all;
    });
    EXPECT_EQ(last, total);
    EXPECT_EQ(total, ExactIntegrator::estimated_operations(view.stride, 256, 256));
}

/// The reference by itself: halving its resolution changes it by less than the tolerance that tests give it.
TEST(Exact, ReferenceHasConverged) {
    const RadianceMap map = random_map(7, 5, 7);
    Lit coarse;
    for (const Vector& n : awkward_normals()) {
        if (coarse.normal.size() == 24) break;
        coarse.normal.push_back(n);
        coarse.irradiance.push_back(reference::irradiance(map, 33.3, n, RESOLUTION));
    }
    EXPECT_LT(relative_rmse(coarse, reference_of(map, 33.3, RESOLUTION / 4)), RESOLUTION_RMSE);
}

}  // namespace
}  // namespace clerestory
