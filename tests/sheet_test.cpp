// The contact sheet: what stands at each place of it, against the program's own pictures and reports.
#include "sheet/sheet.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "draw/canvas.hpp"
#include "image.hpp"
#include "image_files.hpp"
#include "maps.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

using nlohmann::json;

// The layout of src/sheet/sheet.cpp at the smallest panel.
constexpr std::size_t PANEL = 128;
constexpr std::size_t MARGIN = 28;
constexpr std::size_t GAP = 20;
constexpr std::size_t FIRST_ROW = 116;
constexpr std::size_t ROW_STEP = PANEL + 50;
constexpr std::size_t SPHERE = MARGIN + 2 * PANEL + GAP;
constexpr std::size_t ERROR = SPHERE + PANEL + GAP;

/// A PNG as 8-bit codes: read_picture decodes by the gamma that the file names.
struct Codes {
    explicit Codes(const std::string& file) : picture(read_picture(file, options())) {}
    [[nodiscard]] std::array<int, 3> at(std::size_t x, std::size_t y) const {
        std::array<int, 3> codes{};
        for (std::size_t c = 0; c < 3; ++c) {
            const auto linear = static_cast<double>(picture.rgb[3 * (y * picture.width + x) + c]);
            codes[c] = static_cast<int>(std::lround(255 * std::pow(linear, 1 / 2.2)));
        }
        return codes;
    }
    static ReadOptions options() {
        ReadOptions read;
        read.oiio_module = CLERESTORY_OIIO_MODULE;
        return read;
    }
    Picture picture;
};

TEST(Canvas, PicturesLieOnItPixelByPixelAndWhatIsTransparentShowsTheGround) {
    Canvas canvas(40, 20, {10, 20, 30}, {});
    const std::vector<unsigned char> opaque = {255, 0, 0, 255, 0, 255, 0, 255};
    canvas.lay(opaque, 2, 1, 1, 5, 7);
    // A square of four: two parts white, two parts nothing.
    const std::vector<unsigned char> half = {255, 255, 255, 255, 255, 255, 255, 255, 9, 9, 9, 0, 9, 9, 9, 0};
    canvas.lay(half, 1, 1, 2, 39, 19);
    const auto pixel = [&](std::size_t x, std::size_t y) {
        const auto* at = canvas.rgb().data() + 3 * (y * canvas.width() + x);
        return Rgb{at[0], at[1], at[2]};
    };
    EXPECT_EQ(pixel(0, 0), (Rgb{10, 20, 30}));
    EXPECT_EQ(pixel(5, 7), (Rgb{255, 0, 0}));
    EXPECT_EQ(pixel(6, 7), (Rgb{0, 255, 0}));
    EXPECT_EQ(pixel(7, 7), (Rgb{10, 20, 30}));
    EXPECT_EQ(pixel(39, 19), (Rgb{133, 138, 143}));
}

TEST(Canvas, TextIsDrawnWhereItIsAskedForWhateverItSays) {
    const Canvas canvas(200, 60, {255, 255, 255},
                        {{100, 30, "it's {/Bold} \"%d\"\n", 14, Align::centre, true, {0, 0, 0}}});
    std::size_t left = canvas.width();
    std::size_t right = 0;
    for (std::size_t y = 0; y < canvas.height(); ++y) {
        for (std::size_t x = 0; x < canvas.width(); ++x) {
            if (canvas.rgb()[3 * (y * canvas.width() + x)] > 128) continue;
            left = std::min(left, x);
            right = std::max(right, x);
            EXPECT_GT(y, 15U);
            EXPECT_LT(y, 45U);
        }
    }
    ASSERT_LT(left, right);
    EXPECT_NEAR(static_cast<double>(left + right) / 2, 100, 6);  // the text's own bearings and its line end
    EXPECT_GT(right - left, 60U);
}

class SheetCommandTest : public ::testing::Test {
  protected:
    SheetCommandTest() {
        const RadianceMap map = random_map(64, 32, 5);
        write_pfm(map_, 64, 32, {map.rgb.data(), map.rgb.data() + map.rgb.size()});
    }
    json run(const std::vector<std::string>& flags) {
        std::vector<std::string> words = {"sheet", map_, "--panel", "128", "-o", sheet_, "--json", "-", "-q"};
        words.insert(words.end(), flags.begin(), flags.end());
        const ProgramResult result = run_program(words);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return json::parse(result.out);
    }
    TempFolder folder_;
    std::string map_ = folder_.file("map.pfm");
    std::string sheet_ = folder_.file("sheet.png");
};

TEST_F(SheetCommandTest, ShowsWhatRenderAndCompareGive) {
    const std::vector<std::string> flags = {"--rotate-y", "45", "--scale", "2", "--seed", "3", "--control-degree", "0"};
    auto words = flags;
    words.insert(words.end(), {"-n", "16,64"});
    const json report = run(words);
    EXPECT_EQ(names_in(folder_.path()), (std::vector<std::string>{"map.pfm", "sheet.png"}));
    const Codes sheet(sheet_);
    EXPECT_EQ(sheet.picture.width, 2 * MARGIN + 2 * GAP + 4 * PANEL);
    EXPECT_EQ(sheet.picture.height, FIRST_ROW + 3 * ROW_STEP - 30 + MARGIN - GAP);
    EXPECT_EQ(sheet.at(2, 2), (std::array<int, 3>{229, 229, 224}));

    const std::string exposure = std::to_string(report["exposure"].get<double>());
    for (std::size_t k = 0; k < 2; ++k) {
        const std::size_t count = report["rows"][k]["samples"];
        EXPECT_EQ(count, k == 0 ? 16U : 64U);
        std::vector<std::string> render = {"render", map_, "--size", "256", "-q", "-n", std::to_string(count)};
        render.insert(render.end(), flags.begin(), flags.end());
        auto exact = render;
        render.insert(render.end(), {"--exposure", exposure, "-o", folder_.file("s.exr"), "-o", folder_.file("s.png")});
        exact.insert(exact.end(), {"--estimator", "exact", "-o", folder_.file("e.exr")});
        ASSERT_EQ(run_program(render).exit_code, 0);
        ASSERT_EQ(run_program(exact).exit_code, 0);
        const ProgramResult compared =
            run_program({"compare", folder_.file("s.exr"), folder_.file("e.exr"), "--json", "-"});
        const double rel_rmse = json::parse(compared.out)["rel_rmse"];
        // Both are float32 pictures of the same values.
        EXPECT_NEAR(report["rows"][k]["rel_rmse"].get<double>(), rel_rmse, 1e-5 * rel_rmse);
        // The sphere's pixels are means of 2 x 2 of the preview's codes.
        const Codes sphere(folder_.file("s.png"));
        const std::size_t top = FIRST_ROW + (k + 1) * ROW_STEP;
        for (const std::size_t at : {40U, 64U, 90U}) {
            const auto shown = sheet.at(SPHERE + at, top + at);
            for (std::size_t c = 0; c < 3; ++c) {
                double mean = 0;
                for (std::size_t i = 0; i < 4; ++i) mean += sphere.at(2 * at + i % 2, 2 * at + i / 2)[c] / 4.0;
                EXPECT_NEAR(shown[c], mean, 1) << at;  // two roundings
            }
        }
        // Beside the disc the ground shows, of the sphere and of the error.
        EXPECT_EQ(sheet.at(SPHERE, top), (std::array<int, 3>{229, 229, 224}));
        EXPECT_EQ(sheet.at(ERROR, top), (std::array<int, 3>{229, 229, 224}));
        EXPECT_NE(sheet.at(ERROR + 64, top + 64), (std::array<int, 3>{229, 229, 224}));
    }
}

TEST_F(SheetCommandTest, EverySampleIsMarkedWhereItsDirectionLies) {
    run({"-n", "8", "--rotate-y", "90", "--exposure", "1e-9"});
    ASSERT_EQ(run_program({"sample", map_, "-n", "8", "--rotate-y", "90", "-o", folder_.path().string()}).exit_code, 0);
    const Codes sheet(sheet_);
    std::istringstream csv(read_file(folder_.path() / "samples_8.csv"));
    std::string line;
    std::getline(csv, line);
    std::size_t marked = 0;
    while (std::getline(csv, line)) {
        std::vector<double> v;
        std::istringstream fields(line);
        for (std::string field; std::getline(fields, field, ',');) v.push_back(std::stod(field));
        const auto column = static_cast<std::size_t>(v[4] / (2 * M_PI) * 2 * PANEL);
        const auto row = static_cast<std::size_t>(v[3] / M_PI * PANEL);
        EXPECT_EQ(sheet.at(MARGIN + column, FIRST_ROW + ROW_STEP + row), (std::array<int, 3>{0, 255, 0}));
        ++marked;
    }
    EXPECT_EQ(marked, 8U);
}

TEST_F(SheetCommandTest, HasHelpWithAnExample) {
    const ProgramResult result = run_program({"sheet", "--help"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_NE(result.out.find("Example:"), std::string::npos);
}

TEST_F(SheetCommandTest, WhatCannotBeShownIsRefusedAndLeavesNothing) {
    const auto before = names_in(folder_.path());
    EXPECT_EQ(run_program({"sheet", map_, "-o", folder_.file("sheet.jpg")}).exit_code, 2);
    EXPECT_EQ(run_program({"sheet", map_, "--scale", "0", "-o", sheet_}).exit_code, 2);
    EXPECT_EQ(run_program({"sheet", map_, "--estimator", "exact", "-o", sheet_}).exit_code, 2);
    write_pfm(folder_.file("black.pfm"), 4, 2, std::vector<float>(24, 0.0F));
    EXPECT_EQ(run_program({"sheet", folder_.file("black.pfm"), "-o", sheet_}).exit_code, 3);
    EXPECT_EQ(run_program({"sheet", map_, "--panel", "128", "-n", "4", "-o", map_ + "/sheet.png"}).exit_code, 5);
    std::filesystem::remove(folder_.file("black.pfm"));
    EXPECT_EQ(names_in(folder_.path()), before);
}

}  // namespace
}  // namespace clerestory::test
