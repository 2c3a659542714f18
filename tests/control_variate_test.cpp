#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "error.hpp"
#include "lit_sphere.hpp"
#include "maps.hpp"
#include "reference/harmonic.hpp"
#include "sampling/stage3_sample.hpp"
#include "shading/pixels.hpp"
#include "shading/shared.hpp"
#include "shading/stage4_per_pixel.hpp"

namespace clerestory {
namespace {

using test::Lit;
using test::Pixels;

/// The map's control variate, which must outlive what it lends.
struct Control {
    Control(Lit& lit, unsigned degree)
        : shader(lit.shader), map(lit.shader.project(lit.on_device, lit.distribution, {degree, 0})) {}
    [[nodiscard]] ControlVariate lend() { return map.degree == 0 ? ControlVariate{} : ControlVariate{&shader, &map}; }
    HarmonicShader& shader;
    ProjectedMap map;
};

constexpr double pi = std::numbers::pi;

/// A float32 polynomial of ten terms and a cosine of unit vectors in float32: a few units in 2^-24 each.
constexpr double LOBE_TOLERANCE = 1e-6;
/// Float32 rounding of series and samples, of the mean pixel: what remains of the error when noise has gone.
constexpr double ROUNDING = 5e-6;
/// Means over seeds lie this many standard errors from the truth at most.
constexpr double STANDARD_ERRORS = 4;

struct Case {
    std::string name;
    RadianceMap (*make)();
    unsigned degree;
    double rotate_y_deg;
};

std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

std::vector<Case> cases() {
    return {
        {"OneTexel", [] { return test::constant_map(1, 1, 0.3F); }, 8, 0},
        {"TwoHalves", [] { return test::ramp_map(2, 1); }, 20, 37},
        {"ThreeByTwo", [] { return test::block_map(3, 2); }, 7, -90},
        {"LoneTexel", [] { return test::lone_texel_map(8, 4, 1, 6, 3); }, 2, 90},
        {"LonePoleTexel", [] { return test::lone_texel_map(8, 4, 3, 0, 1e-20F); }, 20, 0},
        {"Sun", [] { return test::sun_map(32, 16, 5, 1, 1e6F, 0.05F, true); }, 8, 200},
        {"Random", [] { return test::random_map(64, 32, 5); }, 1, 10},
        {"Huge", [] { return test::checkerboard_map(16, 8, 3e38F); }, 8, 0},
    };
}

class ControlVariates : public testing::TestWithParam<Case> {};

/// Mean and variance of the mean, pixel by pixel and channel by channel, and the same of the whole picture's mean.
struct Moments {
    Pixels sum;
    Pixels squares;
    double whole = 0;
    double whole_squares = 0;
    double count = 0;

    void add(const Pixels& pixels) {
        sum.resize(pixels.size());
        squares.resize(pixels.size());
        double mean = 0;
        for (std::size_t p = 0; p < pixels.size(); ++p) {
            for (std::size_t c = 0; c < 3; ++c) {
                sum[p][c] += pixels[p][c];
                squares[p][c] += pixels[p][c] * pixels[p][c];
                mean += pixels[p][c] / static_cast<double>(3 * pixels.size());
            }
        }
        whole += mean;
        whole_squares += mean * mean;
        count += 1;
    }
    /// Standard error of a mean from a sum and a sum of squares.
    [[nodiscard]] double error(double s, double s2) const {
        return std::sqrt(std::max(0.0, s2 / count - s / count * (s / count)) / (count - 1));
    }
};

/// Whole pictures' means within 4 standard errors; squared deviations of pixels, in standard errors, average to 1.
void expect_unbiased(const Moments& moments, const Pixels& truth) {
    double mean = 0;
    for (const auto& pixel : truth) mean += (pixel[0] + pixel[1] + pixel[2]) / static_cast<double>(3 * truth.size());
    const double whole_error = moments.error(moments.whole, moments.whole_squares);
    EXPECT_NEAR(moments.whole / moments.count, mean, STANDARD_ERRORS * whole_error + ROUNDING * mean);
    double squares = 0;
    for (std::size_t p = 0; p < truth.size(); ++p) {
        for (std::size_t c = 0; c < 3; ++c) {
            const double error = moments.error(moments.sum[p][c], moments.squares[p][c]) + ROUNDING * mean;
            const double deviations = (moments.sum[p][c] / moments.count - truth[p][c]) / error;
            EXPECT_LT(std::abs(deviations), 6) << "pixel " << p << " channel " << c;  // 2e-9 each, a few hundred pixels
            squares += deviations * deviations / static_cast<double>(3 * truth.size());
        }
    }
    // All channels of a grey map, and neighbours under a shared set, deviate together: no sharper limit would hold.
    EXPECT_LT(squares, STANDARD_ERRORS);
}

TEST_P(ControlVariates, PerPixelIsUnbiased) {
    Lit lit(GetParam().make());
    const SphereView view(lit.device, 15);
    const Pixels truth = test::quadrature(lit.map, GetParam().rotate_y_deg, test::normals_of(view));
    Buffer<cl_float> unit_albedo_radiance = view.planes(lit.device);
    SamplingOptions options;
    options.control_degree = GetParam().degree;
    options.rotate_y_deg = GetParam().rotate_y_deg;
    PerPixelShader shader(lit.device, lit.on_device, lit.distribution, options);
    Control control(lit, options.control_degree);
    Moments moments;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        shader.reseed(seed);
        shader.shade(view, 15, unit_albedo_radiance, control.lend());
        moments.add(test::pixels_of(lit, view, unit_albedo_radiance));
    }
    expect_unbiased(moments, truth);
}

TEST_P(ControlVariates, SharedIsUnbiased) {
    Lit lit(GetParam().make());
    const SphereView view(lit.device, 15);
    const Pixels truth = test::quadrature(lit.map, GetParam().rotate_y_deg, test::normals_of(view));
    Buffer<cl_float> unit_albedo_radiance = view.planes(lit.device);
    SamplingOptions options;
    options.control_degree = GetParam().degree;
    options.rotate_y_deg = GetParam().rotate_y_deg;
    Sampler sampler(lit.device, lit.on_device, lit.distribution, options);
    SharedShader shader(lit.device);
    Control control(lit, options.control_degree);
    Moments moments;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        sampler.reseed(seed);
        shader.shade(sampler, lit.distribution, view, 64, unit_albedo_radiance, control.lend());
        moments.add(test::pixels_of(lit, view, unit_albedo_radiance));
    }
    expect_unbiased(moments, truth);
}

INSTANTIATE_TEST_SUITE_P(Maps, ControlVariates, testing::ValuesIn(cases()),
                         [](const auto& tested) { return tested.param.name; });

TEST(ControlVariates, ASampleCountsTheClampedCosineLessItsSeries) {
    Lit lit(test::random_map(64, 32, 9));
    const SphereView view(lit.device, 31);
    const Pixels normals = test::normals_of(view);
    Buffer<cl_float> unit_albedo_radiance = view.planes(lit.device);
    SharedShader shader(lit.device);
    for (const unsigned degree : {1U, 2U, 8U, 13U, 20U}) {
        SamplingOptions options;
        options.control_degree = degree;
        Sampler sampler(lit.device, lit.on_device, lit.distribution, options);
        const SampleSet set = sampler.draw(1);
        const std::vector<float> w = set.direction.download();
        const std::vector<float> radiance = set.radiance.download();
        const double weight = static_cast<double>(radiance[1]) / (pi * static_cast<double>(set.pdf.download()[0]));
        Control control(lit, degree);
        shader.shade(sampler, lit.distribution, view, 1, unit_albedo_radiance, control.lend());
        const Pixels shaded = test::pixels_of(lit, view, unit_albedo_radiance);
        lit.shader.shade_series(control.map, 0, view, unit_albedo_radiance);
        const Pixels series = test::pixels_of(lit, view, unit_albedo_radiance);
        for (std::size_t p = 0; p < normals.size(); ++p) {
            const double x = normals[p][0] * static_cast<double>(w[0]) + normals[p][1] * static_cast<double>(w[1]) +
                             normals[p][2] * static_cast<double>(w[2]);
            const double expected = weight * (std::max(0.0, x) - reference::clamped_cosine_cut(degree, x));
            EXPECT_NEAR(shaded[p][1] - series[p][1], expected, LOBE_TOLERANCE * (weight + std::abs(series[p][1])))
                << "degree " << degree << " pixel " << p;
        }
    }
}

/// Relative RMSE against quadrature, per-pixel, 32 samples.
double per_pixel_error(Lit& lit, const SphereView& view, const Pixels& truth, unsigned degree) {
    SamplingOptions options;
    options.control_degree = degree;
    Buffer<cl_float> unit_albedo_radiance = view.planes(lit.device);
    Control control(lit, degree);
    PerPixelShader(lit.device, lit.on_device, lit.distribution, options)
        .shade(view, 32, unit_albedo_radiance, control.lend());
    return test::relative_rmse(test::pixels_of(lit, view, unit_albedo_radiance), truth);
}

TEST(ControlVariates, DegreeEightIsFifteenTimesBelowPlainOnPhotographedMaps) {
    for (auto& [name, map] : test::bundled_maps()) {
        Lit lit(std::move(map));
        const SphereView view(lit.device, 11);
        const Pixels truth = test::quadrature(lit.map, 0, test::normals_of(view));
        const double plain = per_pixel_error(lit, view, truth, 0);
        EXPECT_GT(plain / per_pixel_error(lit, view, truth, 8), 15) << name;
        EXPECT_GT(per_pixel_error(lit, view, truth, 2), per_pixel_error(lit, view, truth, 20)) << name;
    }
}

TEST(ControlVariates, DegreeOutOfRangeIsRefused) {
    Lit lit(test::constant_map(2, 1, 1));
    SamplingOptions options;
    options.control_degree = SamplingOptions::MAX_CONTROL_DEGREE + 1;
    EXPECT_THROW(PerPixelShader(lit.device, lit.on_device, lit.distribution, options), UsageError);
    Sampler sampler(lit.device, lit.on_device, lit.distribution, options);
    const SphereView view(lit.device, 3);
    Buffer<cl_float> unit_albedo_radiance = view.planes(lit.device);
    SharedShader shader(lit.device);
    EXPECT_THROW(shader.shade(sampler, lit.distribution, view, 4, unit_albedo_radiance), UsageError);
}

TEST(ControlVariates, AnotherDegreesControlVariateIsRefused) {
    Lit lit(test::constant_map(2, 1, 1));
    const SphereView view(lit.device, 3);
    Buffer<cl_float> unit_albedo_radiance = view.planes(lit.device);
    Sampler sampler(lit.device, lit.on_device, lit.distribution, {.control_degree = 8});
    PerPixelShader fresh(lit.device, lit.on_device, lit.distribution, {.control_degree = 8});
    SharedShader shared(lit.device);
    Control other(lit, 2);
    for (const ControlVariate& wrong : {ControlVariate{}, other.lend()}) {
        EXPECT_THROW(shared.shade(sampler, lit.distribution, view, 4, unit_albedo_radiance, wrong), UsageError);
        EXPECT_THROW(fresh.shade(view, 4, unit_albedo_radiance, wrong), UsageError);
    }
}

}  // namespace
}  // namespace clerestory
