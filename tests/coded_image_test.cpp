// TIFF, PNG and JPEG: whole files are read to the last bit, and cut, damaged or lying ones are refused in one line and
// with little memory: never another picture.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <tiff.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
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
using test::ramp;
using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

/// The file's values with alpha, if it has any, as every fourth.
std::vector<float> values_of(const Picture& picture) {
    if (picture.alpha.empty()) return picture.rgb;
    std::vector<float> all;
    for (std::size_t t = 0; t < picture.alpha.size(); ++t) {
        all.insert(all.end(), picture.rgb.begin() + static_cast<std::ptrdiff_t>(3 * t),
                   picture.rgb.begin() + static_cast<std::ptrdiff_t>(3 * t + 3));
        all.push_back(picture.alpha[t]);
    }
    return all;
}

float linear(float v) {
    return static_cast<float>(v <= 0.04045F ? v / 12.92 : std::pow((static_cast<double>(v) + 0.055) / 1.055, 2.4));
}

class CodedImage : public testing::Test {
  protected:
    static ReadOptions options() {
        ReadOptions o;
        o.oiio_module = CLERESTORY_OIIO_MODULE;
        return o;
    }

    /// The picture, or nothing where the file is refused, which must be one line that begins with its name.
    std::optional<std::vector<float>> read(const std::string& name, const ReadOptions& how = options()) {
        try {
            return values_of(read_picture(folder_.file(name), how));
        } catch (const InputError& error) {
            refusal_ = error.what();
            EXPECT_EQ(refusal_.find('\n'), std::string::npos) << refusal_;
            EXPECT_EQ(refusal_.find(folder_.file(name) + ": "), 0U) << refusal_;
            return {};
        }
    }

    /// What is said of a file of these bytes; "" where it is read.
    std::string said(const std::string& name, const std::string& bytes, const ReadOptions& how = options()) {
        test::write_raw(folder_.file(name), bytes);
        refusal_.clear();
        read(name, how);
        return refusal_;
    }

    std::string bytes_of(const test::TiffForm& form) {
        test::write_coded_tiff(folder_.file("whole.tif"), form);
        return test::read_file(folder_.file("whole.tif"));
    }
    std::string bytes_of(const test::PngForm& form) {
        test::write_coded_png(folder_.file("whole.png"), form);
        return test::read_file(folder_.file("whole.png"));
    }
    std::string bytes_of(const test::JpegForm& form) {
        test::write_coded_jpeg(folder_.file("whole.jpg"), form);
        return test::read_file(folder_.file("whole.jpg"));
    }

    /// Cuts `whole`, most closely at both ends: it is refused, or gives the same picture. The share that was refused.
    double cut_everywhere(const std::string& whole) {
        test::write_raw(folder_.file("cut"), whole);
        const auto picture = read("cut");
        EXPECT_TRUE(picture) << refusal_;
        int refused = 0;
        int cuts = 0;
        const std::size_t step = std::max<std::size_t>(whole.size() / 64, 1);
        for (std::size_t length = 1; length < whole.size(); ++cuts) {
            test::write_raw(folder_.file("cut"), whole.substr(0, length));
            const auto found = read("cut");
            refused += !found;
            EXPECT_TRUE(!found || *found == *picture) << length << " of " << whole.size() << " bytes";
            const bool close = length < 32 || length + 32 + step > whole.size();
            length += close ? 1 : step;
        }
        return 1.0 * refused / cuts;
    }

    test::TempFolder folder_;
    std::string refusal_;
};

template <class Form>
std::string name_of(const testing::TestParamInfo<Form>& info) {
    return info.param.name;
}

// --- TIFF

class CodedTiffImage : public CodedImage, public testing::WithParamInterface<test::TiffForm> {};
INSTANTIATE_TEST_SUITE_P(Forms, CodedTiffImage, testing::ValuesIn(test::tiff_forms()), name_of<test::TiffForm>);

TEST_P(CodedTiffImage, EveryValueIsRead) {
    const test::TiffForm& form = GetParam();
    bytes_of(form);
    const Picture picture = read_picture(folder_.file("whole.tif"), options());
    const std::vector<float> stored = test::tiff_values(form);
    const bool grey = form.samples < 3;
    const auto samples = static_cast<std::size_t>(form.samples);
    ASSERT_EQ(picture.width, static_cast<std::size_t>(form.width));
    ASSERT_EQ(picture.height, static_cast<std::size_t>(form.height));
    ASSERT_EQ(picture.alpha.empty(), samples % 2 == 1);
    for (std::size_t t = 0; t < picture.width * picture.height; ++t) {
        for (std::size_t c = 0; c < 3; ++c) {
            const float value = stored[samples * t + (grey ? 0 : c)];
            ASSERT_FLOAT_EQ(picture.rgb[3 * t + c], form.is_float ? value : linear(value)) << t;
        }
        if (samples % 2 == 0) {
            ASSERT_EQ(picture.alpha[t], stored[samples * t + samples - 1]) << t;
        }
    }
}

TEST_P(CodedTiffImage, ACutFileIsRefused) {
    const std::string whole = bytes_of(GetParam());
    EXPECT_GT(cut_everywhere(whole), 0.9);
}

/// Rows are decoded by blocks, in whatever order they are wanted.
TEST_P(CodedTiffImage, AMapMayBeTurnedOver) {
    bytes_of(GetParam());
    ReadOptions flip = options();
    flip.flip_y = true;
    const RadianceMap upright = read_map(folder_.file("whole.tif"), options());
    const RadianceMap turned = read_map(folder_.file("whole.tif"), flip);
    for (std::size_t y = 0; y < upright.height; ++y) {
        for (std::size_t i = 0; i < 3 * upright.width; ++i) {
            ASSERT_EQ(turned.rgb[3 * upright.width * (upright.height - 1 - y) + i],
                      upright.rgb[3 * upright.width * y + i]);
        }
    }
}

/// The place of a tag's number in a little-endian file of one directory.
std::size_t place_of(const std::string& bytes, std::uint16_t tag) {
    const auto number = [&](std::size_t at, std::size_t size) {
        std::uint32_t value = 0;
        std::memcpy(&value, bytes.data() + at, size);
        return value;
    };
    const std::size_t directory = number(4, 4);
    for (std::size_t e = 0; e < number(directory, 2); ++e) {
        const std::size_t at = directory + 2 + 12 * e;
        if (number(at, 2) == tag) return at + 8;
    }
    throw std::runtime_error("no such tag");
}

std::string with_tag(std::string bytes, std::uint16_t tag, std::uint32_t value) {
    const std::size_t at = place_of(bytes, tag);
    const std::uint32_t is_long = 4;
    std::memcpy(bytes.data() + at - 6, &is_long, 2);
    std::memcpy(bytes.data() + at, &value, 4);
    return bytes;
}

/// libtiff may find by itself where a lone strip ends; the picture is the whole one then, or none.
TEST_F(CodedImage, ATiffsStripsLieInTheFile) {
    for (const int compression : {COMPRESSION_NONE, COMPRESSION_ADOBE_DEFLATE}) {
        const std::string whole = bytes_of(test::TiffForm{.compression = static_cast<std::uint16_t>(compression)});
        const auto picture = read("whole.tif");
        for (const std::uint32_t bytes : {0U, 1U, 20U, 1U << 30U, 0xffffffffU}) {
            said("map.tif", with_tag(whole, TIFFTAG_STRIPBYTECOUNTS, bytes));
            const auto found = read("map.tif");
            EXPECT_TRUE(!found || *found == *picture) << bytes;
        }
        EXPECT_THAT(said("map.tif", with_tag(whole, TIFFTAG_STRIPOFFSETS, 100000)), HasSubstr("damaged or cut short"));
    }
    EXPECT_THAT(refusal_, HasSubstr("strip 0 ends at byte 100"));
    const std::string strips = bytes_of(test::TiffForm{.width = 1, .height = 2, .samples = 1, .tile_side = 16});
    EXPECT_THAT(said("map.tif", with_tag(strips, TIFFTAG_TILEBYTECOUNTS, 1)), HasSubstr("tile 0 has 1 bytes for"));
}

/// Deflate has a checksum; libtiff minds it where a strip is decoded as a whole.
TEST_F(CodedImage, ADamagedByteOfDeflateIsNoticed) {
    for (const int bits : {8, 16, 32}) {
        const test::TiffForm form{
            .bits = bits, .is_float = bits == 32, .compression = COMPRESSION_ADOBE_DEFLATE, .rows_per_strip = 3};
        const std::string whole = bytes_of(form);
        const auto picture = read("whole.tif");
        ASSERT_TRUE(picture);
        const std::size_t end =
            whole.find(std::string("\x09\x00\x00\x01", 4)) - 16;  // the directory, behind the strips
        int refused = 0;
        int damaged = 0;
        for (std::size_t at = 8; at < std::min<std::size_t>(end, 200); ++at, ++damaged) {
            std::string bytes = whole;
            bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
            test::write_raw(folder_.file("damaged.tif"), bytes);
            const auto found = read("damaged.tif");
            refused += !found;
            EXPECT_TRUE(!found || *found == *picture) << bits << " bits, byte " << at;
        }
        EXPECT_GT(refused, damaged * 9 / 10);
    }
}

TEST_F(CodedImage, APaletteGivesColours) {
    const test::TiffForm form{.samples = 1, .bits = 8, .is_float = false, .is_palette = true};
    EXPECT_GT(cut_everywhere(bytes_of(form)), 0.9);
    const RadianceMap map = read_map(folder_.file("whole.tif"), options());
    const std::vector<float> stored = test::tiff_values(form);
    for (std::size_t t = 0; t < stored.size(); ++t) {
        ASSERT_FLOAT_EQ(map.rgb[3 * t], linear(stored[t]));
        ASSERT_FLOAT_EQ(map.rgb[3 * t + 1], linear((255 - std::round(255 * stored[t])) / 255));
        ASSERT_FLOAT_EQ(map.rgb[3 * t + 2], linear(7.0F / 255));
    }
    EXPECT_THAT(map.source.channels, ElementsAre("R", "G", "B"));
    EXPECT_EQ(map.source.type, "uint8");
}

TEST_F(CodedImage, AThumbnailDoesNotStandInForAPictureThatIsCut) {
    const test::TiffForm form{.name = {}, .rows_per_strip = 3, .thumbnails = 1};
    const std::string whole = bytes_of(form);
    ReadOptions how = options();
    EXPECT_EQ(read_map(folder_.file("whole.tif"), how).source.part, 1);
    how.part = 0;
    EXPECT_EQ(read_map(folder_.file("whole.tif"), how).width, 2U);
    EXPECT_THAT(said("cut.tif", whole.substr(0, whole.size() - 60)), HasSubstr("damaged or cut short"));
    how.part = 7;
    EXPECT_THAT(said("whole.tif", whole, how), HasSubstr("has no part 7; parts are counted from 0"));
}

TEST_F(CodedImage, ATiffThatIsNotReadIsSaid) {
    const std::string whole = bytes_of(test::TiffForm{.bits = 8, .is_float = false});
    EXPECT_THAT(said("map.tif", with_tag(whole, TIFFTAG_COMPRESSION, COMPRESSION_WEBP)),
                HasSubstr("compressed in a way that is not read here (TIFF's number 50001)"));
    EXPECT_THAT(said("map.tif", with_tag(whole, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_CIELAB)), HasSubstr("has no R, G, B"));
    EXPECT_THAT(said("map.tif", with_tag(whole, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_YCBCR)), HasSubstr("has no R, G, B"));
    const std::string wide = bytes_of(test::TiffForm{.samples = 1, .bits = 64});
    EXPECT_THAT(said("map.tif", with_tag(wide, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT)),
                HasSubstr("is not read by OpenImageIO ("));
}

// --- PNG

class CodedPngImage : public CodedImage, public testing::WithParamInterface<test::PngForm> {};
INSTANTIATE_TEST_SUITE_P(Forms, CodedPngImage, testing::ValuesIn(test::png_forms()), name_of<test::PngForm>);

TEST_P(CodedPngImage, ACutFileIsRefused) {
    const std::string whole = bytes_of(GetParam());
    EXPECT_EQ(cut_everywhere(whole), 1);
}

/// Every chunk has a checksum, those too that a reader may pass over: gAMA says what the values mean.
TEST_P(CodedPngImage, ADamagedByteIsRefused) {
    const std::string whole = bytes_of(GetParam());
    for (std::size_t at = 8; at < whole.size(); ++at) {
        std::string bytes = whole;
        bytes[at] = static_cast<char>(bytes[at] ^ 0x04);
        EXPECT_NE(said("map.png", bytes), "") << at;
    }
}

TEST_F(CodedImage, AnInterlacedPngIsTheSamePicture) {
    for (const int depth : {8, 16}) {
        test::PngForm form{.depth = depth};
        bytes_of(form);
        const auto plain = read("whole.png");
        form.is_interlaced = true;
        bytes_of(form);
        EXPECT_EQ(read("whole.png"), plain);
        EXPECT_TRUE(plain);
    }
}

std::string png_chunk(const std::string& type, const std::string& data) {
    const auto number = [](std::uint32_t value) {
        std::string bytes;
        for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>(value >> shift);
        return bytes;
    };
    const std::string body = type + data;
    const auto sum = crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
    return number(static_cast<std::uint32_t>(data.size())) + body + number(static_cast<std::uint32_t>(sum));
}

/// A PNG of this size whose other chunks are `rest`.
std::string png_of(std::uint32_t width, std::uint32_t height, const std::string& rest) {
    std::string header;
    for (const std::uint32_t side : {width, height}) {
        for (const unsigned shift : {24U, 16U, 8U, 0U}) header += static_cast<char>(side >> shift);
    }
    return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", header + std::string("\x08\x02\0\0\0", 5)) + rest;
}

/// Exif as cameras write it: one entry, the orientation, in either byte order.
std::string exif_of(char orientation, bool big_endian) {
    const std::string little("II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x01\0\0\0\0\0\0\0", 26);
    const std::string big("MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x01\0\0\0\0\0\0", 26);
    std::string exif = big_endian ? big : little;
    exif[big_endian ? 19 : 18] = orientation;
    return exif;
}

TEST_F(CodedImage, APictureThatIsStoredTurnedIsRefused) {
    const std::string png = bytes_of(test::PngForm{});
    const std::string jpeg = bytes_of(test::JpegForm{});
    for (const bool big_endian : {false, true}) {
        for (const char orientation : {'\1', '\6'}) {
            const std::string exif = exif_of(orientation, big_endian);
            const auto expected = orientation == 1 ? testing::Matcher<std::string>("")
                                                   : HasSubstr("is stored turned or mirrored (orientation 6)");
            EXPECT_THAT(said("map.png", png.substr(0, 33) + png_chunk("eXIf", exif) + png.substr(33)), expected);
            const std::string marker = std::string("\xff\xe1\0\x22", 4) + std::string("Exif\0\0", 6) + exif;
            EXPECT_THAT(said("map.jpg", jpeg.substr(0, 2) + marker + jpeg.substr(2)), expected);
        }
    }
    // Shorter than it says: nothing is known then.
    for (std::size_t length = 0; length < 26; ++length) {
        const std::string marker = std::string("\xff\xe1\0", 3) + static_cast<char>(8 + length) +
                                   std::string("Exif\0\0", 6) + exif_of('\1', false).substr(0, length);
        EXPECT_EQ(said("map.jpg", jpeg.substr(0, 2) + marker + jpeg.substr(2)), "");
    }
}

// --- JPEG

class CodedJpegImage : public CodedImage, public testing::WithParamInterface<test::JpegForm> {};
INSTANTIATE_TEST_SUITE_P(Forms, CodedJpegImage, testing::ValuesIn(test::jpeg_forms()), name_of<test::JpegForm>);

TEST_P(CodedJpegImage, ACutFileIsRefused) {
    const std::string whole = bytes_of(GetParam());
    EXPECT_EQ(cut_everywhere(whole), 1);
    for (std::size_t cut = 1; cut < 64; ++cut) {
        EXPECT_THAT(said("map.jpg", whole.substr(0, whole.size() - cut)), HasSubstr("libjpeg: "));
    }
    EXPECT_EQ(said("map.jpg", whole + "what a phone appends"), "");
}

/// Half a picture with an end: libjpeg alone would fill the rest with grey.
TEST_P(CodedJpegImage, AnEndThatIsPutBehindACutDoesNotHideIt) {
    const std::string whole = bytes_of(GetParam());
    if (GetParam().width < 3) return;
    const std::string half = whole.substr(0, whole.size() - 40) + "\xff\xd9";
    EXPECT_THAT(said("map.jpg", half), HasSubstr("libjpeg: "));
}

TEST_F(CodedImage, AJpegOfInksIsRefused) {
    EXPECT_THAT(said("map.jpg", bytes_of(test::JpegForm{.components = 4})), HasSubstr("has no R, G, B"));
}

/// Colours of JPEG, which is not exact, in a TIFF; written as luminance and chroma by libtiff.
TEST_F(CodedImage, AJpegInATiffIsReadAndItsCutsAreRefused) {
    const test::TiffForm form{
        .width = 48, .height = 32, .bits = 8, .is_float = false, .compression = COMPRESSION_JPEG, .rows_per_strip = 16};
    const std::string whole = bytes_of(form);
    const auto picture = read("whole.tif");
    ASSERT_TRUE(picture) << refusal_;
    EXPECT_GT(cut_everywhere(whole), 0.9);
    // The first strip's texels end in nothing.
    std::string bytes = whole;
    const std::size_t end = bytes.find("\xff\xd9", bytes.find("\xff\xda"));
    std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(end) - 60, bytes.begin() + static_cast<std::ptrdiff_t>(end),
              '\xff');
    EXPECT_THAT(said("damaged.tif", bytes), HasSubstr("libtiff: "));
}

// --- Claims and kinds

/// 500 bytes must not take gigabytes, whatever they say.
TEST_F(CodedImage, ClaimsAreRefusedBeforeMemoryIsTaken) {
    using Tags = std::vector<std::pair<std::uint16_t, std::uint32_t>>;
    const auto tiff = [&](test::TiffForm form, const Tags& tags) {
        std::string bytes = bytes_of(form);
        for (const auto& [tag, value] : tags) bytes = with_tag(bytes, tag, value);
        return bytes;
    };
    std::string jpeg = bytes_of(test::JpegForm{});
    jpeg.replace(jpeg.find(std::string("\xff\xc0\0\x11\x08", 5)) + 5, 4, std::string("\x20\0\x40\0", 4));
    const std::string texels = png_chunk("IDAT", std::string(400, '\x55'));
    const Tags large = {{TIFFTAG_IMAGEWIDTH, 16384}, {TIFFTAG_IMAGELENGTH, 8192}, {TIFFTAG_ROWSPERSTRIP, 8192}};
    const Tags huge = {{TIFFTAG_IMAGEWIDTH, 0xffffffff}, {TIFFTAG_IMAGELENGTH, 0xffffffff}};
    const Tags tiles = {{TIFFTAG_TILEWIDTH, 32768}, {TIFFTAG_TILELENGTH, 32768}};
    const Tags tall_tiles = {{TIFFTAG_TILEWIDTH, 16}, {TIFFTAG_TILELENGTH, 0x7ffffff0}};
    const auto coded = [](int compression, int tile_side = 0) {
        return test::TiffForm{
            .width = 64, .height = 32, .compression = static_cast<std::uint16_t>(compression), .tile_side = tile_side};
    };
    EXPECT_EQ(said("map.png", bytes_of(test::PngForm{})), "");  // OpenImageIO takes 130 MB by itself
    rusage before{};
    getrusage(RUSAGE_SELF, &before);
    for (const int compression :
         {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_ZSTD, COMPRESSION_LZMA}) {
        const std::string large_one = tiff(coded(compression), large);
        EXPECT_THAT(said("map.tif", large_one), HasSubstr("damaged or cut short")) << compression;
        EXPECT_NE(said("map.tif", tiff(coded(compression), huge)), "") << compression;
        EXPECT_THAT(said("map.tif", tiff(coded(compression, 64), tiles)), HasSubstr("damaged or cut short"));
        EXPECT_THAT(said("map.tif", tiff(coded(compression, 64), tall_tiles)), HasSubstr("damaged or cut short"));
    }
    EXPECT_THAT(said("map.tif", tiff(coded(COMPRESSION_ADOBE_DEFLATE, 64), tiles)),
                HasSubstr("its tiles are 32768 x 32768 texels for a picture of 64 x 32"));
    EXPECT_THAT(said("map.jpg", jpeg), HasSubstr("bytes cannot hold 16384 x 8192 texels"));
    EXPECT_THAT(said("map.png", png_of(16384, 8192, texels)), HasSubstr("bytes cannot hold 16384 x 8192 texels"));
    EXPECT_THAT(said("map.png", png_of(0x7fffffff, 0x7fffffff, texels)), HasSubstr("bytes cannot hold"));
    EXPECT_NE(said("map.png", png_of(0, 1, texels)), "");
    rusage after{};
    getrusage(RUSAGE_SELF, &after);
    constexpr long spare_kib = 64 * 1024;  // the smallest claim is 400 MB
    EXPECT_LT(after.ru_maxrss, before.ru_maxrss + spare_kib);
}

/// OpenImageIO took a file called x.null for a black map.
TEST_F(CodedImage, NamesAreNothingAndFirstBytesAreAll) {
    const std::string tiff = bytes_of(test::TiffForm{});
    const std::string png = bytes_of(test::PngForm{});
    for (const char* name : {"map", "map.null", "map.png", "map.hdr", "map.tiff.txt", "map.term", "x.socket?a=1"}) {
        EXPECT_EQ(said(name, tiff), "") << name;
        EXPECT_EQ(said(name, png), "") << name;
    }
    EXPECT_THAT(said("map.exr", tiff), HasSubstr("is not an EXR file, whatever its name says"));
}

/// Without the module: what is of no kind that is read is known before it is loaded.
TEST_F(CodedImage, OtherKindsAreRefusedByName) {
    ReadOptions how = options();
    how.oiio_module = "/nowhere/module.so";
    const std::string gif("GIF89a\1\0\1\0\0\0\0;", 14);
    const std::string bmp = "BM" + std::string(52, '\0');
    for (const std::string& bytes :
         {gif, bmp, std::string("P6 2 1 255\n......"), std::string("x"), std::string("II*"), std::string("\x89PNG\r\n"),
          std::string("8BPS and so on"), std::string(200, '\0')}) {
        for (const char* name : {"x.null", "map.gif", "map.tif", "map.term", "map"}) {
            EXPECT_THAT(said(name, bytes, how), AllOf(HasSubstr("EXR, Radiance HDR, PFM, TIFF, PNG and JPEG are"),
                                                      EndsWith("convert it to one of these")));
        }
    }
}

TEST_F(CodedImage, PngAndJpegHaveOnePart) {
    ReadOptions how = options();
    how.part = 1;
    EXPECT_THAT(said("map.png", bytes_of(test::PngForm{}), how), HasSubstr("has no part 1; parts are counted from 0"));
    EXPECT_THAT(said("map.jpg", bytes_of(test::JpegForm{}), how), HasSubstr("has no part 1; parts are counted from 0"));
    how.part = 0;
    EXPECT_EQ(said("map.jpg", bytes_of(test::JpegForm{}), how), "");
    const MapSource source = read_map(folder_.file("map.jpg"), how).source;
    EXPECT_EQ(source.format, "jpeg");
    EXPECT_EQ(source.compression, "jpeg");
    EXPECT_EQ(source.type, "uint8");
    EXPECT_THAT(source.channels, ElementsAre("R", "G", "B"));
}

/// The program's own words and exit code, and that it takes little.
TEST_F(CodedImage, TheProgramEndsWithThree) {
    const std::string tiff = bytes_of(test::TiffForm{.width = 64, .height = 32});
    test::write_raw(folder_.file("cut.tif"), tiff.substr(0, tiff.size() / 3));
    const test::ProgramResult result = test::run_program({"info", folder_.file("cut.tif")});
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_THAT(result.err, HasSubstr("cut.tif: damaged or cut short ("));
}

}  // namespace
}  // namespace clerestory
