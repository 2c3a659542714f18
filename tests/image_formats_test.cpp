// What other writers make of the formats that maps come in: read right, or refused in one true line.
#include <ImfChromaticitiesAttribute.h>
#include <ImfEnvmapAttribute.h>
#include <ImfStandardAttributes.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "coded_files.hpp"
#include "error.hpp"
#include "image.hpp"
#include "image_files.hpp"
#include "run_program.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using test::channel;
using test::ramp;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<float> values(const RadianceMap& map) { return {map.rgb.data(), map.rgb.data() + map.rgb.size()}; }

std::vector<test::ExrChannel> colours(const std::vector<float>& rgb) {
    return {{"R", Imf::FLOAT, channel(rgb, 0)}, {"G", Imf::FLOAT, channel(rgb, 1)}, {"B", Imf::FLOAT, channel(rgb, 2)}};
}

std::string bytes_of(const std::vector<float>& floats) {
    return {reinterpret_cast<const char*>(floats.data()), floats.size() * sizeof(float)};
}

class ImageFormats : public testing::Test {
  protected:
    static ReadOptions options() {
        ReadOptions o;
        o.oiio_module = CLERESTORY_OIIO_MODULE;
        return o;
    }

    RadianceMap read(const std::string& name, ReadOptions how = options()) const {
        return read_map(folder_.file(name), how);
    }

    std::string refusal(const std::string& name, const ReadOptions& how = options()) const {
        try {
            read(name, how);
        } catch (const InputError& error) {
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
            return error.what();
        }
        return "was read";
    }

    static std::vector<std::string> notes(const RadianceMap& map) {
        std::vector<std::string> ids;
        for (const MapNote& note : map.source.notes) ids.push_back(note.id);
        return ids;
    }

    test::TempFolder folder_;
};

// --- EXR: windows, chroma, cubes

struct WindowCase {
    std::string name;
    int width, height, x, y;  ///< of the data window; the display window is 12 x 6 at (2, 3)
    int tile_side = 0;
};

class ImageWindows : public ImageFormats, public testing::WithParamInterface<WindowCase> {};

/// Each texel of the display window against the data window's, by coordinates; with alpha.
TEST_P(ImageWindows, TexelsLieWhereTheDisplayWindowHasThem) {
    const WindowCase& c = GetParam();
    const auto texels = static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height);
    const std::vector<float> rgba = ramp(4 * texels);
    test::ExrLayout layout{.width = c.width, .height = c.height, .origin_x = c.x, .origin_y = c.y};
    layout.tile_side = c.tile_side;
    layout.edit = [](Imf::Header& header) { header.displayWindow() = Imath::Box2i({2, 3}, {13, 8}); };
    std::vector<test::ExrChannel> channels;
    for (const auto& [name, index] : {std::pair{"R", 0U}, {"G", 1U}, {"B", 2U}, {"A", 3U}}) {
        channels.push_back({name, Imf::FLOAT, channel(rgba, index, 4)});
    }
    test::write_test_exr(folder_.file("map.exr"), layout, channels);

    for (const bool flip : {false, true}) {
        ReadOptions how;
        how.flip_y = flip;
        const RadianceMap map = read("map.exr", how);
        const Picture picture = read_picture(folder_.file("map.exr"), how);
        ASSERT_EQ(map.width, 12U);
        ASSERT_EQ(map.height, 6U);
        ASSERT_EQ(picture.rgb, values(map));
        EXPECT_THAT(notes(map), ElementsAre("cropped"));
        EXPECT_FALSE(map.source.plain);
        for (int row = 0; row < 6; ++row) {
            for (int column = 0; column < 12; ++column) {
                const int x = column + 2 - c.x;
                const int y = row + 3 - c.y;
                const bool inside = x >= 0 && x < c.width && y >= 0 && y < c.height;
                const auto at = static_cast<std::size_t>((flip ? 5 - row : row) * 12 + column);
                const auto from = static_cast<std::size_t>(y * c.width + x);
                for (std::size_t k = 0; k < 4; ++k) {
                    const float found = k < 3 ? picture.rgb[3 * at + k] : picture.alpha[at];
                    ASSERT_EQ(found, inside ? rgba[4 * from + k] : 0.0F) << c.name << " " << row << " " << column;
                }
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(
    Windows, ImageWindows,
    testing::Values(WindowCase{"LowerHalf", 12, 3, 2, 6}, WindowCase{"Middle", 4, 2, 5, 5},
                    WindowCase{"OneTexelInACorner", 1, 1, 13, 8}, WindowCase{"OverscanOnEverySide", 30, 40, -9, -17},
                    WindowCase{"OverTheLeftEdge", 6, 6, -2, 3}, WindowCase{"OverTheLowerEdge", 12, 50, 2, 7},
                    WindowCase{"Tiled", 20, 20, -3, 1, 4}, WindowCase{"TiledInside", 5, 4, 4, 4, 3}),
    [](const auto& info) { return info.param.name; });

TEST_F(ImageFormats, AWindowOutsideThePictureIsRefused) {
    test::ExrLayout layout{.width = 4, .height = 2};
    layout.edit = [](Imf::Header& header) { header.displayWindow() = Imath::Box2i({4, 0}, {7, 1}); };
    test::write_test_exr(folder_.file("map.exr"), layout, colours(ramp(24)));
    EXPECT_THAT(refusal("map.exr"), HasSubstr("its texels (4 x 2 at (0, 0)) lie outside its display window"));
    layout.edit = [](Imf::Header& header) { header.displayWindow() = Imath::Box2i({0, 0}, {2000000, 1}); };
    test::write_test_exr(folder_.file("map.exr"), layout, colours(ramp(24)));
    EXPECT_THAT(refusal("map.exr"), HasSubstr("claims 2000001 x 2 texels"));
}

/// Bands of a large map, the windows' rows out of step with the compressed blocks'.
TEST_F(ImageFormats, ALargeCroppedMapIsReadInBands) {
    const int width = 2048;
    const int height = 1501;
    const std::vector<float> rgb = ramp(std::size_t{3} * 2048 * 1501);
    test::ExrLayout layout{.width = width, .height = height, .origin_x = 0, .origin_y = 7};
    layout.edit = [](Imf::Header& header) { header.displayWindow() = Imath::Box2i({0, 0}, {2047, 1600}); };
    test::write_test_exr(folder_.file("map.exr"), layout, colours(rgb));
    std::size_t rows = 0;
    ReadOptions how;
    how.rows_ready = [&](const RadianceMap&, std::size_t begin, std::size_t end) { rows += end - begin; };
    const std::vector<float> found = values(read("map.exr", how));
    EXPECT_EQ(rows, 1601U);
    ASSERT_EQ(found.size(), std::size_t{3} * 2048 * 1601);
    const std::size_t before = std::size_t{3} * 2048 * 7;
    const auto begin = found.begin() + static_cast<std::ptrdiff_t>(before);
    const auto end = begin + static_cast<std::ptrdiff_t>(rgb.size());
    EXPECT_TRUE(std::equal(rgb.begin(), rgb.end(), begin));
    EXPECT_TRUE(std::all_of(found.begin(), begin, [](float v) { return v == 0; }));
    EXPECT_TRUE(std::all_of(end, found.end(), [](float v) { return v == 0; }));
}

/// OpenEXR's own writer and reader: exact for grey, whose chroma is 0, within half floats; colours lose sharpness only.
TEST_F(ImageFormats, LuminanceAndChromaGiveColours) {
    std::vector<float> grey;
    for (std::size_t t = 0; t < 64 * 32; ++t) grey.insert(grey.end(), 3, static_cast<float>(1 + t % 32) / 8);
    test::write_chroma_exr(folder_.file("grey.exr"), 64, 32, grey);
    const RadianceMap map = read("grey.exr");
    EXPECT_THAT(map.source.channels, ElementsAre("Y", "RY", "BY"));
    // Halves have 11 bits, and pass through a sum of three weights.
    for (std::size_t i = 0; i < grey.size(); ++i) ASSERT_NEAR(map.rgb[i], grey[i], grey[i] / 512);

    std::vector<float> orange;
    for (std::size_t t = 0; t < 64 * 32; ++t) orange.insert(orange.end(), {8.0F, 2.0F, 0.5F});
    test::write_chroma_exr(folder_.file("orange.exr"), 64, 32, orange);
    const Picture picture = read_picture(folder_.file("orange.exr"));
    for (std::size_t i = 0; i < orange.size(); ++i) ASSERT_NEAR(picture.rgb[i], orange[i], 8.0F / 256);
}

TEST_F(ImageFormats, ACubeMapIsNoLatitudeLongitudeMap) {
    test::ExrLayout layout{.width = 8, .height = 48};
    layout.edit = [](Imf::Header& header) { Imf::addEnvmap(header, Imf::ENVMAP_CUBE); };
    const std::vector<float> rgb = ramp(std::size_t{3} * 8 * 48);
    test::write_test_exr(folder_.file("cube.exr"), layout, colours(rgb));
    EXPECT_THAT(refusal("cube.exr"), HasSubstr("is a cube map (its envmap attribute says so)"));
    EXPECT_EQ(read_picture(folder_.file("cube.exr")).rgb, rgb) << "two of them may still be compared";
    layout = {.width = 8, .height = 4};
    layout.edit = [](Imf::Header& header) { Imf::addEnvmap(header, Imf::ENVMAP_LATLONG); };
    test::write_test_exr(folder_.file("latlong.exr"), layout, colours(ramp(std::size_t{3} * 8 * 4)));
    EXPECT_THAT(notes(read("latlong.exr")), IsEmpty());
}

TEST_F(ImageFormats, AMapThatIsNotTwiceAsWideAsHighIsSaid) {
    const std::vector<std::pair<int, int>> odd = {{1, 1}, {3, 2}, {4, 4}, {511, 256}};
    for (const auto& [width, height] : odd) {
        const auto texels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
        test::write_pfm(folder_.file("map.pfm"), width, height, ramp(3 * texels));
        EXPECT_THAT(notes(read("map.pfm")), ElementsAre("not_2_to_1")) << width << " x " << height;
    }
    test::write_pfm(folder_.file("map.pfm"), 4, 2, ramp(24));
    EXPECT_THAT(notes(read("map.pfm")), IsEmpty());
}

TEST_F(ImageFormats, PrimariesOfOthersAreSaid) {
    const auto noted = [&](const Imf::Chromaticities& primaries) {
        test::ExrLayout layout{.width = 4, .height = 2};
        layout.edit = [&](Imf::Header& header) { Imf::addChromaticities(header, primaries); };
        test::write_test_exr(folder_.file("map.exr"), layout, colours(ramp(24)));
        return notes(read("map.exr"));
    };
    EXPECT_THAT(noted({{0.64F, 0.33F}, {0.30F, 0.60F}, {0.15F, 0.06F}, {0.3127F, 0.329F}}), IsEmpty());
    // sRGB's ICC profile, as Blender's city.exr has it: Rec. 709 seen from D50.
    EXPECT_THAT(noted({{0.6484F, 0.3309F}, {0.3212F, 0.5979F}, {0.1559F, 0.0661F}, {0.3457F, 0.3585F}}), IsEmpty());
    // ACEScg (AP1) and ACES 2065-1 (AP0)
    EXPECT_THAT(noted({{0.713F, 0.293F}, {0.165F, 0.83F}, {0.128F, 0.044F}, {0.32168F, 0.33767F}}),
                ElementsAre("other_primaries"));
    EXPECT_THAT(noted({{0.7347F, 0.2653F}, {0, 1}, {0.0001F, -0.077F}, {0.32168F, 0.33767F}}),
                ElementsAre("other_primaries"));
}

TEST_F(ImageFormats, WhatLitIsRecorded) {
    test::ExrLayout layout{.width = 4, .height = 2};
    layout.compression = Imf::PIZ_COMPRESSION;
    test::write_exr_parts(
        folder_.file("map.exr"), layout,
        {{"depth", {{"Z", Imf::FLOAT, ramp(8)}}},
         {"main", {{"Sky.R", Imf::HALF, ramp(8)}, {"Sky.G", Imf::HALF, ramp(8)}, {"Sky.B", Imf::HALF, ramp(8)}}}});
    const MapSource source = read("map.exr").source;
    EXPECT_EQ(source.format, "OpenEXR");
    EXPECT_EQ(source.compression, "piz");
    EXPECT_EQ(source.type, "half");
    EXPECT_EQ(source.part, 1);
    EXPECT_EQ(source.layer, "Sky");
    EXPECT_THAT(source.channels, ElementsAre("Sky.R", "Sky.G", "Sky.B"));
    EXPECT_FALSE(source.plain);
    test::write_test_exr(folder_.file("plain.exr"), {4, 2}, colours(ramp(24)));
    EXPECT_TRUE(read("plain.exr").source.plain);
}

// --- PFM

struct PfmCase {
    std::string name;
    std::string header;  ///< for 4 x 2 texels
    std::string tail = {};
    bool big_endian = false;
    float scale = 1;
    bool top_down = false;
};

class ImagePfm : public ImageFormats, public testing::WithParamInterface<PfmCase> {};

TEST_P(ImagePfm, HeadersOfEveryWriterAreRead) {
    const PfmCase& c = GetParam();
    const std::vector<float> rgb = ramp(24);
    std::vector<float> stored = rgb;
    if (!c.top_down) std::swap_ranges(stored.begin(), stored.begin() + 12, stored.begin() + 12);
    std::string bytes = bytes_of(stored);
    for (std::size_t i = 0; c.big_endian && i < bytes.size(); i += 4) std::reverse(&bytes[i], &bytes[i] + 4);
    test::write_raw(folder_.file("map.pfm"), c.header + bytes + c.tail);
    std::vector<float> expected = rgb;
    for (float& v : expected) v *= c.scale;
    const RadianceMap map = read("map.pfm");
    EXPECT_EQ(values(map), expected);
    EXPECT_THAT(notes(map), c.top_down ? testing::Matcher<std::vector<std::string>>(ElementsAre("top_down"))
                                       : testing::Matcher<std::vector<std::string>>(IsEmpty()));
}

INSTANTIATE_TEST_SUITE_P(
    Headers, ImagePfm,
    testing::Values(PfmCase{"Usual", "PF\n4 2\n-1.0\n"}, PfmCase{"CarriageReturns", "PF\r\n4 2\r\n-1.0\r\n"},
                    PfmCase{"CarriageReturnsAndATail", "PF\r\n4 2\r\n-1.0\r\n", "tail"},
                    PfmCase{"ABlankAfterTheScale", "PF\n4 2\n-1.0 \n"},
                    PfmCase{"ABlankBeforeEveryEnd", "PF \n4 2 \n-1.0 \r\n"}, PfmCase{"BlankLine", "PF\n4 2\n-1.0\n\n"},
                    PfmCase{"OneLine", "PF 4 2 -1.0\n"}, PfmCase{"Comment", "PF\n# by hand\n4 2\n-1.0\n"},
                    PfmCase{"ATail", "PF\n4 2\n-1.0\n", "and more\n"}, PfmCase{"Exponent", "PF\n4 2\n-1e+00\n"},
                    PfmCase{"BigEndian", "PF\n4 2\n1.0\n", "", true},
                    PfmCase{"Scaled", "PF\n4 2\n-2.5\n", "", false, 2.5F},
                    PfmCase{"Photoshop", "PF\n4\n2\n-1.000000\n", "", false, 1, true},
                    PfmCase{"PhotoshopBigEndian", "PF\n4\n2\n1.000000\n", "", true, 1, true}),
    [](const auto& info) { return info.param.name; });

/// Values whose bytes are blanks must not be taken for the header's end.
TEST_F(ImageFormats, APfmsValuesMayLookLikeBlanks) {
    std::uint32_t blanks = 0x20202020;
    float value = 0;
    std::memcpy(&value, &blanks, sizeof value);
    const std::vector<float> rgb(24, value);
    for (const char* header : {"PF\n4 2\n-1.0\n", "PF\r\n4 2\r\n-1.0\r\n", "PF\n4 2\n-1.0 \n"}) {
        test::write_raw(folder_.file("map.pfm"), header + bytes_of(rgb));
        EXPECT_EQ(values(read("map.pfm")), rgb) << header;
    }
}

TEST_F(ImageFormats, APfmThatIsNoneIsSaid) {
    const std::string raster = bytes_of(ramp(24));
    const auto said = [&](const std::string& bytes) {
        test::write_raw(folder_.file("map.pfm"), bytes);
        return refusal("map.pfm");
    };
    EXPECT_THAT(said("PF\n4 2\n-1.0\n" + raster.substr(1)), HasSubstr("95 bytes of values in place of 96"));
    EXPECT_THAT(said("PF\n4 2\n-1.0"), HasSubstr("its PFM header should hold"));
    EXPECT_THAT(said("PF\n4 2\n"), HasSubstr("its PFM header should hold"));
    EXPECT_THAT(said("PF\n4 two\n-1.0\n" + raster), HasSubstr("its PFM header should hold"));
    EXPECT_THAT(said("PF\n4 2\n0\n" + raster), HasSubstr("a number other than 0"));
    EXPECT_THAT(said("PF\n4 2\nnan\n" + raster), HasSubstr("a number other than 0"));
    EXPECT_THAT(said("PF\n0 2\n-1\n" + raster), HasSubstr("has no texels"));
    EXPECT_THAT(said("PF\n-4 2\n-1\n" + raster), HasSubstr("has no texels"));
    EXPECT_THAT(said("PF\n99999999 99999999\n-1\n" + raster), HasSubstr("beyond the limits"));
}

// --- Radiance

/// The texels' codes; a scale of 1 has the exponent 136.
std::string codes(const std::vector<int>& bytes) { return {bytes.begin(), bytes.end()}; }

std::string radiance(const std::string& lines, const std::string& size, const std::string& data) {
    return "#?RADIANCE\n" + lines + "\n" + size + "\n" + data;
}

TEST_F(ImageFormats, RadianceRunsOfBothKindsAreRead) {
    // 9 x 1: a run of 8 and a literal in each component.
    const std::string coded = codes({2, 2, 0, 9, 136, 10, 1, 11, 136, 20, 1, 21, 136, 30, 1, 31, 137, 136});
    test::write_raw(folder_.file("map.hdr"), radiance("FORMAT=32-bit_rle_rgbe\n", "-Y 1 +X 9", coded));
    std::vector<float> expected;
    for (int x = 0; x < 8; ++x) expected.insert(expected.end(), {10, 20, 30});
    expected.insert(expected.end(), {11, 21, 31});
    EXPECT_EQ(values(read("map.hdr")), expected);

    // The older coding: 1, 1, 1 repeats the texel before; a second mark counts in 256s.
    const std::string old = codes({10, 20, 30, 136, 1, 1, 1, 7, 11, 21, 31, 136});
    test::write_raw(folder_.file("map.hdr"), radiance("FORMAT=32-bit_rle_rgbe\n", "-Y 1 +X 9", old));
    EXPECT_EQ(values(read("map.hdr")), expected);
    const std::string long_run = codes({10, 20, 30, 136, 1, 1, 1, 3, 1, 1, 1, 2});
    test::write_raw(folder_.file("map.hdr"), radiance("", "-Y 1 +X 516", long_run));
    const std::vector<float> repeated = values(read("map.hdr"));
    ASSERT_EQ(repeated.size(), 3U * 516);
    for (std::size_t x = 0; x < 516; ++x) EXPECT_EQ(repeated[3 * x + 1], 20);
}

/// Other programs' readers know the newer coding alone.
TEST_F(ImageFormats, ARadianceFileIsPlainWhereOthersReadItToo) {
    const std::string coded = codes({2, 2, 0, 9, 137, 10, 137, 20, 137, 30, 137, 136});
    const std::string old = codes({10, 20, 30, 136, 1, 1, 1, 8});
    const auto is_plain = [&](const std::string& lines, const std::string& size, const std::string& data) {
        test::write_raw(folder_.file("map.hdr"), radiance(lines, size, data));
        return read("map.hdr").source.plain;
    };
    EXPECT_TRUE(is_plain("FORMAT=32-bit_rle_rgbe\n", "-Y 1 +X 9", coded));
    EXPECT_FALSE(is_plain("FORMAT=32-bit_rle_rgbe\n", "-Y 1 +X 9", old));
    EXPECT_FALSE(is_plain("FORMAT=32-bit_rle_rgbe\n", "+Y 1 +X 9", coded));
    EXPECT_FALSE(is_plain("FORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n", "-Y 1 +X 9", coded));
}

TEST_F(ImageFormats, RadianceFilesMayBeTurnedOver) {
    const std::string data = codes({1, 0, 0, 136, 2, 0, 0, 136, 3, 0, 0, 136, 4, 0, 0, 136});
    const auto reds = [&](const std::string& size, bool flip = false) {
        test::write_raw(folder_.file("map.hdr"), radiance("FORMAT=32-bit_rle_rgbe\n", size, data));
        ReadOptions how = options();
        how.flip_y = flip;
        return channel(values(read("map.hdr", how)), 0);
    };
    EXPECT_THAT(reds("-Y 2 +X 2"), ElementsAre(1, 2, 3, 4));
    EXPECT_THAT(reds("+Y 2 +X 2"), ElementsAre(3, 4, 1, 2));
    EXPECT_THAT(reds("+Y 2 +X 2", true), ElementsAre(1, 2, 3, 4));
    EXPECT_THAT(reds("-Y 2 -X 2"), ElementsAre(2, 1, 4, 3));
    test::write_raw(folder_.file("map.hdr"), radiance("FORMAT=32-bit_rle_rgbe\n", "+X 2 -Y 2", data));
    EXPECT_THAT(refusal("map.hdr"), HasSubstr("stored column by column"));
}

TEST_F(ImageFormats, RadianceHeadersMayBeLongAndEndAsDosHasIt) {
    const std::string data = codes({1, 2, 3, 136, 1, 2, 3, 136});
    const std::string lines =
        "# " + std::string(5000, 'c') + "\nSOFTWARE=" + std::string(128, 's') + "\nFORMAT=32-bit_rle_rgbe\n";
    test::write_raw(folder_.file("map.hdr"), radiance(lines, "-Y 1 +X 2", data));
    EXPECT_THAT(values(read("map.hdr")), ElementsAre(1, 2, 3, 1, 2, 3));
    test::write_raw(folder_.file("map.hdr"), "#?RGBE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 1 +X 2\r\n" + data);
    EXPECT_THAT(values(read("map.hdr")), ElementsAre(1, 2, 3, 1, 2, 3));
}

TEST_F(ImageFormats, WhatARadianceHeaderSaysOfItsValuesIsSaid) {
    const std::string data = codes({1, 2, 3, 136, 1, 2, 3, 136});
    const auto noted = [&](const std::string& lines) {
        test::write_raw(folder_.file("map.hdr"), radiance("FORMAT=32-bit_rle_rgbe\n" + lines, "-Y 1 +X 2", data));
        const RadianceMap map = read("map.hdr");
        EXPECT_THAT(values(map), ElementsAre(1, 2, 3, 1, 2, 3));
        return notes(map);
    };
    EXPECT_THAT(noted("EXPOSURE=2\nEXPOSURE= 2.0\n"), ElementsAre("exposure"));
    EXPECT_THAT(read("map.hdr").source.notes[0].text, HasSubstr("multiplied by 4 (EXPOSURE)"));
    EXPECT_THAT(read("map.hdr").source.notes[0].text, HasSubstr("--scale 0.25"));
    EXPECT_THAT(noted("EXPOSURE=0\n"), ElementsAre("exposure"));
    EXPECT_THAT(read("map.hdr").source.notes[0].text, testing::Not(HasSubstr("--scale")));
    EXPECT_THAT(noted("EXPOSURE=1\nGAMMA=1.0\nCOLORCORR=1 1 1\nPIXASPECT=1\nVIEW= -vta\n"), IsEmpty());
    EXPECT_THAT(noted("COLORCORR= 1 2 3\n"), ElementsAre("colour_correction"));
    EXPECT_THAT(noted("GAMMA=2.2\n"), ElementsAre("gamma"));
    EXPECT_THAT(noted("PRIMARIES=0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333\n"), IsEmpty());
    EXPECT_THAT(noted("PRIMARIES= 0.64 0.33 0.30 0.60 0.15 0.06 0.3127 0.3290\n"), IsEmpty());
    EXPECT_THAT(noted("PRIMARIES= 0.708 0.292 0.17 0.797 0.131 0.046 0.3127 0.3290\n"), ElementsAre("other_primaries"));
}

TEST_F(ImageFormats, ARadianceFileThatCannotBeReadIsSaid) {
    const std::string data = codes({1, 2, 3, 136, 1, 2, 3, 136});
    const auto said = [&](const std::string& bytes) {
        test::write_raw(folder_.file("map.hdr"), bytes);
        return refusal("map.hdr");
    };
    EXPECT_THAT(said(radiance("FORMAT=32-bit_rle_xyze\n", "-Y 1 +X 2", data)), HasSubstr("holds CIE X, Y, Z"));
    EXPECT_THAT(said(radiance("FORMAT=ascii\n", "-Y 1 +X 2", data)), HasSubstr("an unknown FORMAT=ascii"));
    EXPECT_THAT(said(radiance("", "-Y 1", data)), HasSubstr("names no size"));
    EXPECT_THAT(said("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n"), HasSubstr("its header does not end"));
    EXPECT_THAT(said(radiance("", "-Y 2 +X 2", data)), HasSubstr("rows are missing"));
    EXPECT_THAT(said(radiance("", "-Y 3 +X 2", data)), HasSubstr("bytes cannot hold 2 x 3 texels"));
    const std::string rest(8, '\0');
    const std::string row = codes({2, 2, 64, 0}) + std::string(500, '\xff');
    EXPECT_THAT(said(radiance("", "-Y 8192 +X 16384", row)), HasSubstr("bytes cannot hold 16384 x 8192 texels"));
    EXPECT_THAT(said(radiance("", "-Y 0 +X 2", data)), HasSubstr("has no texels"));
    EXPECT_THAT(said(radiance("", "-Y 9999999999 +X 9999999999", data)), HasSubstr("beyond the limits"));
    EXPECT_THAT(said(radiance("", "-Y 1 +X 9", codes({2, 2, 0, 8, 136, 1}) + rest)), HasSubstr("another width"));
    EXPECT_THAT(said(radiance("", "-Y 1 +X 9", codes({2, 2, 0, 9, 140, 1, 0, 0}) + rest)),
                HasSubstr("a run leaves its row"));
    EXPECT_THAT(said(radiance("", "-Y 1 +X 9", codes({2, 2, 0, 9, 0, 1, 0, 0}) + rest)),
                HasSubstr("a run leaves its row"));
    EXPECT_THAT(said(radiance("", "-Y 1 +X 2", codes({1, 1, 1, 1, 1, 1, 1, 1}))), HasSubstr("a run leaves its row"));
}

/// Rows can be asked for again and out of order, as windows and pictures do.
TEST_F(ImageFormats, PfmAndRadianceHaveNoLayers) {
    test::write_pfm(folder_.file("map.pfm"), 2, 1, ramp(6));
    test::write_rgbe(folder_.file("map.hdr"), 2, 1, ramp(6));
    for (const char* name : {"map.pfm", "map.hdr"}) {
        ReadOptions how = options();
        how.layer = "sky";
        EXPECT_THAT(refusal(name, how), HasSubstr("has no layers"));
        how = options();
        how.part = 1;
        EXPECT_THAT(refusal(name, how), HasSubstr("has no part 1, only part 0"));
        how.part = 0;
        EXPECT_EQ(values(read(name, how)), ramp(6));
    }
}

// --- TIFF and what else OpenImageIO reads

TEST_F(ImageFormats, LogLuvTiffIsRefusedNotClipped) {
    constexpr std::uint16_t BITS = 258;
    constexpr std::uint16_t COMPRESSION = 259;
    constexpr std::uint16_t PHOTOMETRIC = 262;
    constexpr std::uint16_t SAMPLE_FORMAT = 339;
    constexpr std::uint32_t WHOLE_NUMBERS = 2;
    constexpr std::uint32_t SGILOG = 34676;
    for (const std::uint32_t encoding : {32844U, 32845U}) {
        const int channels = encoding == 32844U ? 1 : 3;
        test::write_float_tiff(
            folder_.file("log.tif"), 4, 2, channels, ramp(8 * static_cast<std::size_t>(channels)),
            {{BITS, 16}, {COMPRESSION, SGILOG}, {PHOTOMETRIC, encoding}, {SAMPLE_FORMAT, WHOLE_NUMBERS}});
        EXPECT_THAT(refusal("log.tif"), HasSubstr("LogLuv or LogL")) << encoding;
    }
}

TEST_F(ImageFormats, TiffChannelsThatAreNoColourAreRefused) {
    constexpr std::uint16_t PHOTOMETRIC = 262;
    test::write_float_tiff(folder_.file("two.tif"), 4, 2, 2, ramp(16));
    EXPECT_THAT(refusal("two.tif"), HasSubstr("has no R, G, B and not one grey channel alone"));
    test::write_float_tiff(folder_.file("ink.tif"), 4, 2, 5, ramp(40), {{PHOTOMETRIC, 5}});
    EXPECT_THAT(refusal("ink.tif"), HasSubstr("has no R, G, B"));
}

TEST_F(ImageFormats, TiffHasPagesAndNoLayers) {
    test::write_float_tiff(folder_.file("map.tif"), 4, 2, 3, ramp(24));
    ReadOptions how = options();
    how.part = 1;
    EXPECT_THAT(refusal("map.tif", how), HasSubstr("has no part 1"));
    how.part = 0;
    EXPECT_EQ(values(read("map.tif", how)), ramp(24));
    how.layer = "sky";
    EXPECT_THAT(refusal("map.tif", how), HasSubstr("has no layers"));
    EXPECT_EQ(read("map.tif").source.format, "tiff");
    EXPECT_EQ(read("map.tif").source.type, "float");
    EXPECT_FALSE(read("map.tif").source.plain);
}

/// oiiotool --crop leaves a TIFF with the whole's size.
TEST_F(ImageFormats, ACroppedTiffIsPlacedToo) {
    constexpr std::uint16_t FULL_WIDTH = 33300;
    constexpr std::uint16_t FULL_LENGTH = 33301;
    test::write_float_tiff(folder_.file("map.tif"), 4, 2, 1, ramp(8), {{FULL_WIDTH, 6}, {FULL_LENGTH, 3}});
    const RadianceMap map = read("map.tif");
    ASSERT_EQ(map.width, 6U);
    ASSERT_EQ(map.height, 3U);
    EXPECT_THAT(notes(map), ElementsAre("cropped"));
    for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 6; ++column) {
            const bool inside = row < 2 && column < 4;
            EXPECT_EQ(map.rgb[3 * (6 * row + column) + 1], inside ? ramp(8)[4 * row + column] : 0.0F);
        }
    }
}

/// A name in a file must not reach the terminal as commands.
TEST_F(ImageFormats, NamesAreShownAsOneLine) {
    const std::string name = "a\n\x1b[31m";
    test::write_exr_parts(folder_.file("map.exr"), {4, 2}, {{"left", colours(ramp(24))}, {name, colours(ramp(24))}});
    EXPECT_THAT(read("map.exr").source.notes[0].text, HasSubstr("such as a\\n\\x1b[31m"));
}

TEST_F(ImageFormats, EightBitsAreSaid) {
    test::write_coded_tiff(folder_.file("map.tif"), {.width = 2, .height = 1, .bits = 8, .is_float = false});
    const RadianceMap map = read("map.tif");
    EXPECT_THAT(notes(map), ElementsAre("eight_bit"));
    EXPECT_THAT(map.source.notes[0].text, HasSubstr("uint8 values, decoded through the sRGB curve"));
}

}  // namespace
}  // namespace clerestory
