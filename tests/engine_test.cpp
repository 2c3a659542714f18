// The public interface: what it gives is what the stages behind it give, and what it made outlives it.
#include "engine.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <optional>

#include "clerestory/clerestory.hpp"
#include "run_program.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

RadianceMap ramp(std::size_t width, std::size_t height) {
    RadianceMap map;
    map.width = width;
    map.height = height;
    map.rgb = PageBuffer(3 * width * height);
    for (std::size_t i = 0; i < map.rgb.size(); ++i) map.rgb[i] = static_cast<float>(i % 17) / 4;
    return map;
}

RadianceMap constant(std::size_t width, std::size_t height, float value) {
    RadianceMap map = ramp(width, height);
    std::fill_n(map.rgb.data(), map.rgb.size(), value);
    return map;
}

TEST(Engine, AConstantMapHasItsIntegralAndLightsEveryPixelAlike) {
    Engine engine(test::test_options());
    const EnvironmentMap environment = engine.environment(constant(8, 4, 2));
    EXPECT_NEAR(environment.phi(), 2 * 4 * std::numbers::pi, 1e-5);
    EXPECT_FALSE(environment.black());
    const Rendered picture = engine.render(environment, {.estimator = Estimator::exact, .size = 9, .albedo = 0.5});
    ASSERT_EQ(picture.size, 9U);
    ASSERT_EQ(picture.rgba.size(), 4U * 81);
    EXPECT_EQ(picture.rgba[3], 0);  // a corner
    // Radiance 2 from everywhere leaves a diffuse surface of albedo 1/2 as radiance 1.
    EXPECT_NEAR(picture.rgba[4 * 40], 1, 2e-6);
    EXPECT_EQ(picture.rgba[4 * 40 + 3], 1);
}

TEST(Engine, RecordsEstimateTheMapsIntegral) {
    Engine engine(test::test_options());
    const EnvironmentMap environment = engine.environment(ramp(32, 16));
    const Samples samples = engine.draw(environment, 4096, {.sequence = Sequence::sobol});
    EXPECT_EQ(samples.count(), 4096U);
    double sum = 0;
    for (const SampleRecord& s : samples.records()) {
        EXPECT_LT(s.row, 16U);
        EXPECT_LT(s.column, 32U);
        EXPECT_EQ(s.rgb[0], environment.map().rgb[3 * (s.row * 32 + s.column)]);
        sum += (static_cast<double>(s.rgb[0]) + s.rgb[1] + s.rgb[2]) / 3 / s.pdf;
    }
    // The density is the intensity over its integral, to the rounding of the integer tables (2^-31 of a row each).
    EXPECT_NEAR(sum / 4096 / environment.phi(), 1, 1e-6);
}

TEST(Engine, SetsOfDifferentOptionsDoNotMix) {
    Engine engine(test::test_options());
    const EnvironmentMap first = engine.environment(ramp(32, 16));
    const EnvironmentMap second = engine.environment(constant(16, 8, 1));
    const auto texels = [&](const EnvironmentMap& environment, std::uint64_t seed) {
        std::vector<std::size_t> places;
        for (const auto& s : engine.draw(environment, 64, {.seed = seed}).records())
            places.push_back(s.row * 64 + s.column);
        return places;
    };
    const auto a = texels(first, 1);
    const auto b = texels(first, 2);
    const auto c = texels(second, 1);
    EXPECT_NE(a, b);
    EXPECT_NE(a, c);
    EXPECT_EQ(texels(first, 1), a);
    EXPECT_EQ(texels(second, 1), c);
}

TEST(Engine, WhatItMadeOutlivesIt) {
    std::optional<Samples> samples;
    {
        Engine engine(test::test_options());
        samples = engine.draw(engine.environment(ramp(16, 8)), 16);
    }
    EXPECT_EQ(samples->records().size(), 16U);
}

TEST(Engine, ThePictureIsThatOfTheProgram) {
    const test::TempFolder folder;
    Engine engine(test::test_options());
    const EnvironmentMap environment = engine.environment(read_map(bundled_map("sunset")));
    RenderOptions options;
    options.samples = 64;
    options.size = 33;
    options.sampling.control_degree = 8;
    options.sampling.seed = 7;
    engine.write(folder.file("library.exr"), engine.render(environment, options), {}, {{"note", {.text = "ours"}}});
    const auto run = test::run_program({"render", bundled_map("sunset").string(), "-n", "64", "--size", "33", "--seed",
                                        "7", "-q", "-o", folder.file("program.exr")});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const Picture ours = read_picture(folder.file("library.exr"));
    EXPECT_EQ(ours.rgb, read_picture(folder.file("program.exr")).rgb);
    EXPECT_EQ(read_exr_header(folder.file("library.exr")).at("note").text, "ours");
    EXPECT_EQ(compare(ours, ours).rmse, 0);
}

TEST(Engine, PreviewsFollowTheToneCurve) {
    Engine engine(test::test_options());
    const EnvironmentMap environment = engine.environment(constant(16, 8, 0.25F));
    const Rendered picture = engine.render(environment, {.estimator = Estimator::exact, .size = 5});
    const auto bytes = engine.preview(picture, {.exposure = 2, .gamma = 1});
    ASSERT_EQ(bytes.size(), 4U * 25);
    EXPECT_EQ(bytes[4 * 12], 128);  // round(255 / 2)
    EXPECT_EQ(bytes[4 * 12 + 3], 255);
    EXPECT_EQ(bytes[3], 0);  // a corner, beside the sphere
}

TEST(Engine, MarksAreGreenWhereSamplesLie) {
    Engine engine(test::test_options());
    const EnvironmentMap environment = engine.environment(constant(64, 32, 0.5F));
    const Samples samples = engine.draw(environment, 4);
    const auto bytes = engine.marked_map(environment, samples);
    ASSERT_EQ(bytes.size(), 4U * 64 * 32);
    for (const SampleRecord& s : samples.records()) {
        const unsigned char* texel = bytes.data() + 4 * (s.row * 64 + s.column);
        EXPECT_THAT(std::vector<int>(texel, texel + 4), testing::ElementsAre(0, 255, 0, 255));
    }
}

TEST(Engine, ATargetIsReached) {
    Engine engine(test::test_options());
    const EnvironmentMap environment = engine.environment(ramp(64, 32));
    RenderOptions asked;
    asked.size = 33;
    const TargetChoice choice = engine.choose(environment, asked, 0.05);
    EXPECT_LE(choice.reached_error, 0.05);
    EXPECT_EQ(choice.method.size, 33U);
    EXPECT_FALSE(choice.choice.empty());
    EXPECT_THROW(engine.choose(environment, asked, 0), UsageError);
}

TEST(Engine, BadTexelsAreRefusedOrBlackened) {
    Engine engine(test::test_options());
    const auto broken = [] {
        RadianceMap map = ramp(8, 4);
        map.rgb[30] = std::nanf("");
        return map;
    };
    EXPECT_THROW(engine.environment(broken()), InputError);
    const EnvironmentMap repaired = engine.environment(broken(), {.bad_texels = BadTexels::zero});
    EXPECT_EQ(repaired.repaired(), 1U);
    EXPECT_EQ(repaired.map().rgb[30], 0);
}

TEST(Engine, WhatCannotBeDoneIsSaid) {
    Engine engine(test::test_options());
    const EnvironmentMap black = engine.environment(constant(4, 2, 0));
    EXPECT_TRUE(black.black());
    EXPECT_THROW(engine.draw(black, 4), InputError);
    EXPECT_THROW(engine.draw(engine.environment(ramp(4, 2)), 0), UsageError);
    EXPECT_THROW(engine.write("sphere.jpg", engine.render(black, {.size = 3})), UsageError);
    EXPECT_THROW(Engine({.selector = "first"}), UsageError);
    EXPECT_THROW(Engine({.selector = "9:9"}), DeviceError);
}

TEST(Engine, OptionsOutOfTheirRangesAreRefused) {
    Engine engine(test::test_options());
    const EnvironmentMap environment = engine.environment(ramp(8, 4));
    const double nan = std::nan("");
    const std::vector<RenderOptions> wrong = {{.samples = 0},
                                              {.samples = (std::size_t{1} << 30) + 1},
                                              {.size = 0},
                                              {.size = 16385},
                                              {.albedo = -1},
                                              {.albedo = nan},
                                              {.scale = nan},
                                              {.scale = 1e31},
                                              {.sampling = {.rotate_y_deg = nan}},
                                              {.sampling = {.rotate_y_deg = 1e7}},
                                              {.sampling = {.control_degree = 21}},
                                              {.harmonic = {.degree = 41}},
                                              {.harmonic = {.lights = 4097}}};
    for (const RenderOptions& options : wrong) {
        EXPECT_THROW(engine.render(environment, options), UsageError);
        EXPECT_THROW(engine.choose(environment, options, 0.01), UsageError);
    }
    EXPECT_THROW(engine.draw(environment, 0), UsageError);
    EXPECT_THROW(engine.draw(environment, 4, {.rotate_y_deg = nan}), UsageError);
    const Rendered picture = engine.render(environment, {.size = 3});
    EXPECT_THROW(engine.preview(picture, {.exposure = nan}), UsageError);
    EXPECT_THROW(engine.preview(picture, {.gamma = 0}), UsageError);
}

TEST(Engine, ArraysThatDoNotFitTheirSizesAreRefused) {
    Engine engine(test::test_options());
    EXPECT_THROW(engine.environment({}), UsageError);
    RadianceMap wide = ramp(8, 4);
    wide.width = 9;
    EXPECT_THROW(engine.environment(std::move(wide)), UsageError);
    RadianceMap endless = ramp(8, 4);
    endless.width = endless.height = std::size_t{1} << 63;
    EXPECT_THROW(engine.environment(std::move(endless)), UsageError);
    Rendered picture = engine.render(engine.environment(ramp(8, 4)), {.size = 3});
    picture.size = 4;
    EXPECT_THROW(engine.preview(picture), UsageError);
    EXPECT_THROW(engine.write("picture.png", picture), UsageError);
}

TEST(Engine, WhatAnotherMadeIsRefused) {
    Engine engine(test::test_options());
    Engine other(test::test_options());
    const EnvironmentMap foreign = other.environment(ramp(8, 4));
    EXPECT_THROW(engine.render(foreign), UsageError);
    EXPECT_THROW(engine.draw(foreign, 4), UsageError);
    EXPECT_THROW(engine.choose(foreign, {}, 0.1), UsageError);
    const EnvironmentMap own = engine.environment(ramp(8, 4));
    const Samples samples = engine.draw(own, 4);
    EXPECT_THROW(engine.marked_map(foreign, samples), UsageError);
    EXPECT_THROW(engine.marked_map(engine.environment(ramp(4, 2)), samples), UsageError);
}

}  // namespace
}  // namespace clerestory
