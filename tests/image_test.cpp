#include "image.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include "coded_files.hpp"
#include "error.hpp"
#include "image_files.hpp"
#include "run_program.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using test::channel;
using test::ramp;

std::vector<float> values(const RadianceMap& map) { return {map.rgb.data(), map.rgb.data() + map.rgb.size()}; }

std::vector<float> flipped(const std::vector<float>& rgb, std::size_t rows) {
    const auto row = static_cast<std::ptrdiff_t>(rgb.size() / rows);
    std::vector<float> out;
    for (auto y = static_cast<std::ptrdiff_t>(rows); y-- > 0;) {
        out.insert(out.end(), rgb.begin() + y * row, rgb.begin() + (y + 1) * row);
    }
    return out;
}

ReadOptions options() {
    ReadOptions o;
    o.oiio_module = CLERESTORY_OIIO_MODULE;
    return o;
}

std::vector<test::ExrChannel> rgb_channels(const std::vector<float>& rgb, Imf::PixelType type = Imf::FLOAT) {
    return {{"R", type, channel(rgb, 0)}, {"G", type, channel(rgb, 1)}, {"B", type, channel(rgb, 2)}};
}

class Image : public testing::Test {
  protected:
    test::TempFolder folder_;
    std::string file_ = folder_.file("map.exr");
};

struct ExrCase {
    std::string name;
    test::ExrLayout layout;
    Imf::PixelType type = Imf::FLOAT;
};

class ImageExr : public testing::TestWithParam<ExrCase> {};

/// Lossless storage gives back every value, both ways up, whatever the blocks, tiles and data window.
TEST_P(ImageExr, EveryTexelComesBackInItsPlace) {
    const auto& [name, layout, type] = GetParam();
    const test::TempFolder folder;
    const auto rows = static_cast<std::size_t>(layout.height);
    const std::vector<float> rgb =
        ramp(3 * static_cast<std::size_t>(layout.width) * rows, type == Imf::UINT ? 1 : 1.0F / 64);
    test::write_test_exr(folder.file("map.exr"), layout, rgb_channels(rgb, type));

    ReadOptions upright;
    const RadianceMap map = read_map(folder.file("map.exr"), upright);
    EXPECT_EQ(map.width, static_cast<std::size_t>(layout.width));
    EXPECT_EQ(map.height, rows);
    EXPECT_EQ(values(map), rgb);

    upright.flip_y = true;
    EXPECT_EQ(values(read_map(folder.file("map.exr"), upright)), flipped(rgb, rows));
}

INSTANTIATE_TEST_SUITE_P(
    Layouts, ImageExr,
    testing::Values(ExrCase{"OneTexel", {1, 1}}, ExrCase{"OneRow", {257, 1}}, ExrCase{"OneColumn", {1, 89}},
                    ExrCase{"Odd", {257, 89}}, ExrCase{"Half", {257, 89}, Imf::HALF},
                    ExrCase{"Uint", {64, 32}, Imf::UINT}, ExrCase{"WindowInside", {33, 17, 100, 200}},
                    ExrCase{"WindowNegative", {33, 17, -1000, -3}},
                    ExrCase{"WindowNegativeTiled", {33, 17, -1000, -3, 8}}, ExrCase{"Tiled", {257, 89, 0, 0, 32}},
                    ExrCase{"TiledHalf", {257, 89, 5, 7, 64}, Imf::HALF},
                    ExrCase{"MipMapped", {64, 32, 0, 0, 16, true}},
                    ExrCase{"Uncompressed", {257, 89, 0, 0, 0, false, Imf::NO_COMPRESSION}},
                    ExrCase{"RunLength", {257, 89, 0, 0, 0, false, Imf::RLE_COMPRESSION}},
                    ExrCase{"ZipSingle", {257, 89, 0, 0, 0, false, Imf::ZIPS_COMPRESSION}},
                    ExrCase{"Piz", {257, 89, 0, 0, 0, false, Imf::PIZ_COMPRESSION}},
                    // Large enough for OpenEXR's threads and for several bands.
                    ExrCase{"Threads", {1024, 512}, Imf::HALF}, ExrCase{"ThreadsTiled", {1000, 512, 0, 0, 64}}),
    [](const auto& info) { return info.param.name; });

class ImageBands : public testing::TestWithParam<bool> {};

/// What overlapping work relies on: each row is announced once, never two calls at a time, with its final values.
TEST_P(ImageBands, RowsAreFinalWhenTheyAreAnnounced) {
    const test::TempFolder folder;
    const std::size_t width = 2048;
    const std::size_t height = 3001;
    const std::vector<float> rgb = ramp(3 * width * height);
    test::write_test_exr(folder.file("map.exr"), {width, height}, rgb_channels(rgb, Imf::HALF));
    const bool flip = GetParam();
    const std::vector<float> expected = flip ? flipped(rgb, height) : rgb;

    std::vector<int> announced(height, 0);
    int calls = 0;
    std::mutex one_at_a_time;
    ReadOptions with_bands;
    with_bands.flip_y = flip;
    with_bands.rows_ready = [&](const RadianceMap& map, std::size_t begin, std::size_t end) {
        const std::unique_lock lock(one_at_a_time, std::try_to_lock);
        ASSERT_TRUE(lock.owns_lock());
        ASSERT_LT(begin, end);
        ASSERT_LE(end, height);
        ++calls;
        for (std::size_t y = begin; y < end; ++y) ++announced[y];
        ASSERT_TRUE(std::equal(map.rgb.data() + 3 * width * begin, map.rgb.data() + 3 * width * end,
                               expected.begin() + static_cast<std::ptrdiff_t>(3 * width * begin)));
    };
    const RadianceMap map = read_map(folder.file("map.exr"), with_bands);
    EXPECT_GT(calls, 1);
    EXPECT_THAT(announced, testing::Each(1));
    EXPECT_EQ(values(map), expected);
}

INSTANTIATE_TEST_SUITE_P(BothWaysUp, ImageBands, testing::Bool());

TEST_F(Image, AFailureInTheRowsCallbackEndsTheReading) {
    const std::size_t width = 2048;
    const std::size_t height = 3001;
    test::write_test_exr(file_, {width, height}, rgb_channels(ramp(3 * width * height), Imf::HALF));
    ReadOptions failing;
    failing.rows_ready = [](const RadianceMap&, std::size_t, std::size_t) { throw DeviceError("no more memory"); };
    EXPECT_THROW(read_map(file_, failing), DeviceError);
}

struct NamesCase {
    std::string name;
    std::vector<std::string> channels;
    std::vector<std::size_t> expected;  ///< which of the channels are red, green, blue
};

class ImageChannels : public testing::TestWithParam<NamesCase> {};

TEST_P(ImageChannels, AreFoundByTheirNames) {
    const auto& [name, names, expected] = GetParam();
    const test::TempFolder folder;
    std::vector<test::ExrChannel> channels;
    for (std::size_t c = 0; c < names.size(); ++c) {
        channels.push_back({names[c], Imf::FLOAT, std::vector<float>(6, static_cast<float>(c))});
    }
    test::write_test_exr(folder.file("map.exr"), {3, 2}, channels);
    const RadianceMap map = read_map(folder.file("map.exr"), {});
    for (std::size_t t = 0; t < 6; ++t) {
        for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(map.rgb[3 * t + c], static_cast<float>(expected[c]));
    }
}

INSTANTIATE_TEST_SUITE_P(
    Names, ImageChannels,
    testing::Values(NamesCase{"Rgb", {"R", "G", "B"}, {0, 1, 2}}, NamesCase{"Rgba", {"A", "R", "G", "B"}, {1, 2, 3}},
                    NamesCase{"RgbAndDepth", {"Z", "A", "R", "G", "B"}, {2, 3, 4}},
                    NamesCase{"Luminance", {"Y"}, {0, 0, 0}}, NamesCase{"LuminanceAndAlpha", {"A", "Y"}, {1, 1, 1}},
                    NamesCase{"LowerCase", {"r", "g", "b"}, {0, 1, 2}},
                    NamesCase{"Words", {"Blue", "GREEN", "red"}, {2, 1, 0}},
                    NamesCase{"Layer", {"sky.B", "sky.G", "sky.R"}, {2, 1, 0}},
                    NamesCase{"UnnamedLayerFirst", {"a.R", "a.G", "a.B", "R", "G", "B"}, {3, 4, 5}}),
    [](const auto& info) { return info.param.name; });

TEST_F(Image, ReadsThePartAfterDeepSamples) {
    const std::vector<float> rgb = ramp(3 * 5 * 4);
    test::write_deep_then_flat(file_, {5, 4}, rgb_channels(rgb));
    EXPECT_EQ(values(read_map(file_, {})), rgb);
}

TEST_F(Image, AWrittenExrComesBackWithItsHeaderAndAlpha) {
    const std::size_t width = 67;
    const std::size_t height = 31;
    const std::vector<float> rgba = ramp(4 * width * height);
    Header header;
    header["clerestory:estimator"] = {"shared", 0, false};
    header["seconds"] = {"", 0.1, true};
    write_exr(file_, width, height, rgba.data(), header);

    const Picture picture = read_picture(file_);
    ASSERT_EQ(picture.width, width);
    ASSERT_EQ(picture.height, height);
    EXPECT_EQ(picture.alpha, channel(rgba, 3, 4));
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(channel(picture.rgb, c), channel(rgba, c, 4));
    const Header back = read_exr_header(file_);
    EXPECT_EQ(back.at("clerestory:estimator").text, "shared");
    EXPECT_FALSE(back.at("clerestory:estimator").is_number);
    EXPECT_TRUE(back.at("seconds").is_number);
    EXPECT_EQ(back.at("seconds").number, 0.1);
    EXPECT_THAT(test::names_in(folder_.path()), testing::ElementsAre("map.exr"));
}

TEST_F(Image, PicturesTurnOverWithTheirAlpha) {
    const std::vector<float> rgba = ramp(4 * 6);
    write_exr(file_, 2, 3, rgba.data(), {});
    ReadOptions flip;
    flip.flip_y = true;
    EXPECT_EQ(read_picture(file_, flip).alpha, flipped(channel(rgba, 3, 4), 3));
}

TEST_F(Image, APageBufferLiesOnAPage) {
    for (const std::size_t count : {std::size_t{1}, std::size_t{4096}, std::size_t{1} << 21}) {
        const PageBuffer buffer(count);
        EXPECT_EQ(reinterpret_cast<std::uintptr_t>(buffer.data()) % 4096, 0U);
        EXPECT_EQ(buffer.size(), count);
    }
}

TEST_F(Image, RadianceFilesOfEveryOtherKindAreReadWithTheTopRowFirst) {
    const int width = 9;
    const int height = 7;
    const std::vector<float> rgb = ramp(3 * 9 * 7);
    test::write_pfm(folder_.file("map.pfm"), width, height, rgb);
    test::write_float_tiff(folder_.file("map.tif"), width, height, 3, rgb);
    // Any value up to 255 / 64 fits RGBE's shared exponent.
    test::write_rgbe(folder_.file("map.hdr"), width, height, rgb);
    for (const char* name : {"map.pfm", "map.tif", "map.hdr"}) {
        EXPECT_EQ(values(read_map(folder_.file(name), options())), rgb) << name;
        ReadOptions flip = options();
        flip.flip_y = true;
        EXPECT_EQ(values(read_map(folder_.file(name), flip)), flipped(rgb, height)) << name;
    }
}

/// Tiles hang over the right and the lower edge, and there are more rows of them than one band holds.
TEST_F(Image, TiledFilesOfOtherKindsAreReadBothWaysUp) {
    const std::vector<float> rgb = ramp(3 * 37 * 85);
    test::write_tiled_float_tiff(folder_.file("map.tif"), 37, 85, 3, 16, rgb);
    EXPECT_EQ(values(read_map(folder_.file("map.tif"), options())), rgb);
    ReadOptions flip = options();
    flip.flip_y = true;
    EXPECT_EQ(values(read_map(folder_.file("map.tif"), flip)), flipped(rgb, 85));
}

TEST_F(Image, OtherKindsHaveAnyNumberOfChannels) {
    const std::vector<float> one = ramp(9 * 7);
    test::write_grey_pfm(folder_.file("one.pfm"), 9, 7, one);
    test::write_float_tiff(folder_.file("one.tif"), 9, 7, 1, one);
    for (const char* name : {"one.pfm", "one.tif"}) {
        const std::vector<float> rgb = values(read_map(folder_.file(name), options()));
        for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(channel(rgb, c), one) << name;
    }
    const std::vector<float> four = ramp(4 * 9 * 7);
    test::write_float_tiff(folder_.file("four.tif"), 9, 7, 4, four);
    const Picture picture = read_picture(folder_.file("four.tif"), options());
    EXPECT_EQ(picture.alpha, channel(four, 3, 4));
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(channel(picture.rgb, c), channel(four, c, 4));
}

/// IEC 61966-2-1, for a format that says nothing about its encoding.
TEST_F(Image, IntegersAreDecodedAsSrgb) {
    const test::TiffForm form{.width = 256, .height = 1, .samples = 1, .bits = 8, .is_float = false};
    test::write_coded_tiff(folder_.file("codes.tif"), form);
    const RadianceMap map = read_map(folder_.file("codes.tif"), options());
    const std::vector<float> codes = test::tiff_values(form);
    for (std::size_t code = 0; code < 256; ++code) {
        const double v = codes[code];
        const double linear = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
        EXPECT_FLOAT_EQ(map.rgb[3 * code], static_cast<float>(linear)) << code;
    }
}

/// The previews' own encoding: gamma 2.2, alpha not multiplied in.
TEST_F(Image, APngOfOursComesBackLinearAndMultipliedByItsAlpha) {
    std::vector<unsigned char> pixels;
    for (int code = 0; code < 256; ++code) {
        for (const int value : {code, 255 - code, 128, code}) pixels.push_back(static_cast<unsigned char>(value));
    }
    write_png(folder_.file("codes.png"), 64, 4, 4, pixels.data());
    const Picture picture = read_picture(folder_.file("codes.png"), options());
    ASSERT_EQ(picture.width, 64U);
    ASSERT_EQ(picture.height, 4U);
    ASSERT_EQ(picture.alpha.size(), 256U);
    // The file holds 1/2.2 in units of 1e-5, 45455, so that the exponent read back is off by 1e-5.
    constexpr double exponent_error = 2e-5;
    for (std::size_t t = 0; t < 256; ++t) {
        const double alpha = static_cast<double>(t) / 255;
        EXPECT_FLOAT_EQ(picture.alpha[t], static_cast<float>(alpha));
        for (std::size_t c = 0; c < 3; ++c) {
            const double expected = alpha * std::pow(pixels[4 * t + c] / 255.0, 2.2);
            // d(v^g) = v^g ln(v) dg, and |v^g ln v| < 1 / (e g) < 0.2; the rest is float's rounding.
            EXPECT_NEAR(picture.rgb[3 * t + c], expected, 0.2 * exponent_error + 1.2e-7) << t;
        }
    }
}

TEST_F(Image, APngWithoutAlphaHasNone) {
    const std::vector<unsigned char> pixels(std::size_t{3} * 5 * 2, 255);
    write_png(folder_.file("white.png"), 5, 2, 3, pixels.data());
    const Picture picture = read_picture(folder_.file("white.png"), options());
    EXPECT_TRUE(picture.alpha.empty());
    EXPECT_THAT(picture.rgb, testing::Each(1.0F));
}

/// A lossy codec's negatives are its error; a lossless one's are in the map and left for the check of bad texels.
TEST_F(Image, NegativesOfALossyCodecBecomeZeroAndAreCounted) {
    std::vector<float> rgb(std::size_t{3} * 64 * 32, 0.5F);
    rgb[3 * 100] = -0.25F;
    test::write_test_exr(file_, {64, 32}, rgb_channels(rgb));
    const RadianceMap lossless = read_map(file_, {});
    EXPECT_EQ(lossless.rgb[3 * 100], -0.25F);
    EXPECT_EQ(lossless.ringing, 0U);

    test::write_test_exr(file_, {64, 32, 0, 0, 0, false, Imf::DWAA_COMPRESSION}, rgb_channels(rgb));
    const Picture raw = read_picture(file_);
    const RadianceMap repaired = read_map(file_, {});
    EXPECT_GT(repaired.ringing, 0U);
    std::size_t negative = 0;
    for (std::size_t i = 0; i < raw.rgb.size(); ++i) {
        negative += raw.rgb[i] < 0;
        EXPECT_EQ(repaired.rgb[i], std::max(raw.rgb[i], 0.0F));
    }
    EXPECT_EQ(repaired.ringing, negative);
}

}  // namespace
}  // namespace clerestory
