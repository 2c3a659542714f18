// Light lists, read back as another renderer would: shaded with in double they give the program's own picture.
#include "picture/light_list.hpp"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "error.hpp"
#include "image_files.hpp"
#include "maps.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

using nlohmann::json;

constexpr double ALBEDO = 0.7;
constexpr std::size_t SIDE = 65;

// The picture is made in float32. Roundings of 2^-24 of a sum of terms that are all positive: 10 of a light's weight
// (its row's and column's probabilities and their product, the solid angle, two quotients, two products, the share of
// the samples and the gain), one a light of a block of 256 and one a block for the sums. Beside that each cosine is off
// by 4 roundings of 1: the normal's and the three of the scalar product.
constexpr double ROUNDING = 0x1p-24;
constexpr double COSINE_ROUNDINGS = 4;
double sum_roundings(std::size_t lights) { return 10 + 256 + std::ceil(static_cast<double>(lights) / 256); }

struct Case {
    std::string name;
    std::vector<std::string> flags;  ///< of `sample` and `render` alike
    std::size_t samples;
};
void PrintTo(const Case& what, std::ostream* out) { *out << what.name; }

/// The picture of a diffuse sphere under the lights, compared with `picture` pixel by pixel.
void expect_same_sphere(const std::vector<DirectionalLight>& lights, const Picture& picture) {
    double total[3] = {};
    for (const DirectionalLight& light : lights) {
        for (std::size_t c = 0; c < 3; ++c) total[c] += light.weight[c];
    }
    std::size_t shown = 0;
    for (std::size_t row = 0; row < SIDE; ++row) {
        for (std::size_t column = 0; column < SIDE; ++column) {
            const double x = 2 * (static_cast<double>(column) + 0.5) / SIDE - 1;
            const double y = 1 - 2 * (static_cast<double>(row) + 0.5) / SIDE;
            if (x * x + y * y >= 1) continue;
            const double n[3] = {x, y, std::sqrt(1 - x * x - y * y)};
            ++shown;
            double sum[3] = {};
            for (const DirectionalLight& light : lights) {
                double cosine = 0;
                for (std::size_t c = 0; c < 3; ++c) cosine += n[c] * static_cast<double>(light.direction[c]);
                for (std::size_t c = 0; c < 3; ++c) sum[c] += light.weight[c] * std::max(cosine, 0.0);
            }
            for (std::size_t c = 0; c < 3; ++c) {
                const double expected = sum[c] * ALBEDO / std::numbers::pi;
                const double tolerance = ROUNDING * (sum_roundings(lights.size()) * expected +
                                                     COSINE_ROUNDINGS * total[c] * ALBEDO / std::numbers::pi);
                ASSERT_NEAR(static_cast<double>(picture.rgb[3 * (row * SIDE + column) + c]), expected, tolerance)
                    << "row " << row << ", column " << column << ", channel " << c;
            }
        }
    }
    EXPECT_GT(shown, SIDE * SIDE / 2);
}

std::vector<DirectionalLight> lights_of_json(const json& list) {
    std::vector<DirectionalLight> lights;
    for (const auto& entry : list["lights"]) {
        DirectionalLight& light = lights.emplace_back();
        for (std::size_t c = 0; c < 3; ++c) {
            light.direction[c] = entry["direction"][c].get<float>();
            light.weight[c] = entry["weight"][c].get<double>();
        }
    }
    return lights;
}

/// Every pixel of the image as a light.
std::vector<DirectionalLight> lights_of_exr(const std::string& file) {
    Imf::InputFile in(file.c_str());
    const auto window = in.header().dataWindow();
    const auto width = static_cast<std::size_t>(window.max.x + 1);
    const auto height = static_cast<std::size_t>(window.max.y + 1);
    const std::vector<std::string> names = {"direction.X", "direction.Y", "direction.Z", "R", "G", "B"};
    std::vector<std::vector<float>> planes(names.size(), std::vector<float>(width * height));
    Imf::FrameBuffer buffer;
    for (std::size_t k = 0; k < names.size(); ++k) {
        EXPECT_NE(in.header().channels().findChannel(names[k]), nullptr) << names[k];
        buffer.insert(names[k], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(planes[k].data()), sizeof(float),
                                           sizeof(float) * width));
    }
    in.setFrameBuffer(buffer);
    in.readPixels(window.min.y, window.max.y);
    std::vector<DirectionalLight> lights(width * height);
    for (std::size_t i = 0; i < lights.size(); ++i) {
        for (std::size_t c = 0; c < 3; ++c) {
            lights[i].direction[c] = planes[c][i];
            lights[i].weight[c] = static_cast<double>(planes[3 + c][i]);
        }
    }
    return lights;
}

class LightListOf : public ::testing::TestWithParam<Case> {};

TEST_P(LightListOf, ShadesTheSphereAsRenderDoes) {
    const Case& what = GetParam();
    const TempFolder folder;
    const RadianceMap map = random_map(64, 32, 3);
    write_pfm(folder.file("map.pfm"), 64, 32, {map.rgb.data(), map.rgb.data() + map.rgb.size()});
    std::vector<std::string> sample = {"sample", folder.file("map.pfm"), "-n",       std::to_string(what.samples),
                                       "-o",     folder.path().string(), "--lights", "json,exr"};
    std::vector<std::string> render = {"render",
                                       folder.file("map.pfm"),
                                       "-n",
                                       std::to_string(what.samples),
                                       "--control-degree",
                                       "0",
                                       "--size",
                                       std::to_string(SIDE),
                                       "--albedo",
                                       std::to_string(ALBEDO),
                                       "-o",
                                       folder.file("sphere.exr")};
    sample.insert(sample.end(), what.flags.begin(), what.flags.end());
    render.insert(render.end(), what.flags.begin(), what.flags.end());
    ASSERT_EQ(run_program(sample).exit_code, 0);
    ASSERT_EQ(run_program(render).exit_code, 0);
    const Picture picture = read_picture(folder.file("sphere.exr"));
    const std::string stem = "lights_" + std::to_string(what.samples);

    const json list = json::parse(read_file(folder.path() / (stem + ".json")));
    EXPECT_EQ(list["format"], "clerestory-lights");
    EXPECT_EQ(list["version"], 1);
    EXPECT_EQ(list["samples"], what.samples);
    const auto lights = lights_of_json(list);
    ASSERT_EQ(lights.size(), what.samples);
    expect_same_sphere(lights, picture);

    const auto pixels = lights_of_exr(folder.file(stem + ".exr"));
    EXPECT_EQ(read_exr_header(folder.file(stem + ".exr")).at("clerestory:samples").number,
              static_cast<double>(what.samples));
    ASSERT_GE(pixels.size(), lights.size());
    expect_same_sphere({pixels.begin(), pixels.begin() + static_cast<std::ptrdiff_t>(lights.size())}, picture);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        if (i >= lights.size()) {
            EXPECT_EQ(pixels[i].weight[0] + pixels[i].weight[1] + pixels[i].weight[2], 0);
        }
        const double length =
            std::hypot(static_cast<double>(pixels[i].direction[0]), static_cast<double>(pixels[i].direction[1]),
                       static_cast<double>(pixels[i].direction[2]));
        ASSERT_NEAR(length, 1, 1e-6);  // the bound of tests/stage3_sample_test.cpp on a direction, rounded up
    }
}

INSTANTIATE_TEST_SUITE_P(
    Flags, LightListOf,
    ::testing::Values(Case{"plain", {}, 64},
                      Case{"turned", {"--flip-y", "--rotate-y", "37", "--scale", "8", "--seed", "11"}, 256},
                      Case{"centres", {"--texel", "centre", "--sequence", "stratified"}, 100},
                      Case{"severalRows", {"--sequence", "sobol", "--luminance", "rec709"}, 5000}),
    [](const auto& info) { return info.param.name; });

TEST(LightList, AWeightBeyondFloat32IsRefusedAndNothingIsLeft) {
    const TempFolder folder;
    DirectionalLight light;
    light.weight[1] = 1e39;
    try {
        write_lights_exr(folder.path() / "lights.exr", {light}, json::object());
        FAIL() << "it was written";
    } catch (const OutputError& error) {
        EXPECT_NE(std::string(error.what()).find("--scale"), std::string::npos) << error.what();
    }
    EXPECT_TRUE(names_in(folder.path()).empty());
}

TEST(LightList, AnUnknownFormatIsAUsageError) { EXPECT_EQ(run_program({"sample", "--lights", "csv"}).exit_code, 2); }

}  // namespace
}  // namespace clerestory::test
