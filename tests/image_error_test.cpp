#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "error.hpp"
#include "image.hpp"
#include "image_files.hpp"
#include "run_program.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using test::channel;
using testing::HasSubstr;
using testing::StartsWith;

ReadOptions options() {
    ReadOptions o;
    o.oiio_module = CLERESTORY_OIIO_MODULE;
    return o;
}

std::vector<test::ExrChannel> rgb_channels(const std::vector<float>& rgb, int sampling = 1) {
    return {{"R", Imf::FLOAT, channel(rgb, 0), sampling},
            {"G", Imf::FLOAT, channel(rgb, 1)},
            {"B", Imf::FLOAT, channel(rgb, 2)}};
}

class ImageErrors : public testing::Test {
  protected:
    /// The one line that reading `file` fails with; it must begin with the file's name.
    static std::string refusal(const fs::path& file, const ReadOptions& how = options()) {
        try {
            read_map(file, how);
        } catch (const InputError& e) {
            EXPECT_THAT(e.what(), StartsWith(file.string() + ": "));
            EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
            return e.what();
        }
        ADD_FAILURE() << file << " was read";
        return {};
    }

    /// Cuts `whole` after every hundredth of its length: reading must fail, or give every value of the whole file.
    void cut_everywhere(const std::string& whole, const std::string& name, const std::vector<float>& rgb) {
        const fs::path file = folder_.path() / name;
        int refused = 0;
        for (std::size_t percent = 0; percent < 100; ++percent) {
            test::write_raw(file, whole.substr(0, whole.size() * percent / 100));
            try {
                const RadianceMap map = read_map(file, options());
                EXPECT_EQ(std::vector<float>(map.rgb.data(), map.rgb.data() + map.rgb.size()), rgb)
                    << name << " at " << percent << " %";
            } catch (const InputError& e) {
                ++refused;
                EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
            }
        }
        EXPECT_GE(refused, 90) << name;
    }

    test::TempFolder folder_;
    fs::path file_ = folder_.path() / "map.exr";
};

/// Found by fuzz/map_fuzz.cpp: OpenEXR takes what an attribute claims before it reads, here 1.7 GB for 400 bytes.
TEST_F(ImageErrors, AnAttributeLongerThanItsFileIsRefusedBeforeMemoryIsTaken) {
    test::write_test_exr(file_, {.width = 4, .height = 2}, rgb_channels(test::ramp(24)));
    std::ifstream in(file_, std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(in), {}};
    const std::string type("chlist\0", 7);
    bytes.replace(bytes.find(type) + type.size(), 4, "iiii");
    test::write_raw(file_, bytes);
    EXPECT_THAT(refusal(file_), HasSubstr("an attribute claims 1768515945 of the file's"));
    EXPECT_THROW(read_exr_header(file_), InputError);
}

TEST_F(ImageErrors, WhatIsNotAnImageIsSaidInOneLine) {
    EXPECT_THAT(refusal(file_), HasSubstr("no such file"));
    EXPECT_THAT(refusal(folder_.path()), HasSubstr("is a folder"));
    test::write_raw(file_, "");
    EXPECT_THAT(refusal(file_), HasSubstr("is empty"));
    EXPECT_THAT(refusal(file_ / "below"), HasSubstr("no such file"));
    test::write_raw(file_, "Dear reader, this is a letter.\n");
    EXPECT_THAT(refusal(file_), HasSubstr("is not an EXR file"));
    fs::rename(file_, folder_.path() / "letter.txt");
    EXPECT_THAT(refusal(folder_.path() / "letter.txt"), HasSubstr("is of no kind that is read, by its first bytes"));
    test::write_raw(folder_.path() / "letter.hdr", "Dear reader, this is a letter.\n");
    refusal(folder_.path() / "letter.hdr");
    ASSERT_EQ(mkfifo((folder_.path() / "pipe").c_str(), 0600), 0);
    EXPECT_THAT(refusal(folder_.path() / "pipe"), HasSubstr("is not a regular file"));
}

TEST_F(ImageErrors, ACutExrIsNeverFilledInSilence) {
    const std::vector<float> rgb = test::ramp(std::size_t{3} * 61 * 47);
    for (const test::ExrLayout& layout : {test::ExrLayout{61, 47}, test::ExrLayout{61, 47, 0, 0, 16},
                                          test::ExrLayout{61, 47, 0, 0, 0, false, Imf::NO_COMPRESSION},
                                          test::ExrLayout{61, 47, 0, 0, 0, false, Imf::PIZ_COMPRESSION}}) {
        test::write_test_exr(file_, layout, rgb_channels(rgb));
        cut_everywhere(test::read_file(file_), "cut.exr", rgb);
    }
    test::write_deep_then_flat(file_, {61, 47}, rgb_channels(rgb));
    cut_everywhere(test::read_file(file_), "cut.exr", rgb);
}

TEST_F(ImageErrors, ACutFileOfAnotherKindIsNeverFilledInSilence) {
    const std::vector<float> rgb = test::ramp(std::size_t{3} * 61 * 47, 1.0F / 8);
    test::write_pfm(folder_.path() / "map.pfm", 61, 47, rgb);
    cut_everywhere(test::read_file(folder_.path() / "map.pfm"), "cut.pfm", rgb);
    test::write_float_tiff(folder_.path() / "map.tif", 61, 47, 3, rgb);
    cut_everywhere(test::read_file(folder_.path() / "map.tif"), "cut.tif", rgb);
    const std::vector<float> small = test::ramp(std::size_t{3} * 17 * 5);
    test::write_rgbe(folder_.path() / "map.hdr", 17, 5, small);
    cut_everywhere(test::read_file(folder_.path() / "map.hdr"), "cut.hdr", small);
}

/// A damaged byte anywhere may give an error or other values, never a crash.
TEST_F(ImageErrors, ADamagedByteDoesNotCrash) {
    const std::vector<float> rgb = test::ramp(std::size_t{3} * 31 * 17);
    test::write_test_exr(file_, {31, 17}, rgb_channels(rgb));
    const std::string whole = test::read_file(file_);
    ReadOptions small = options();
    small.limits.max_texels = 1 << 20;
    std::size_t ended = 0;
    for (std::size_t at = 4; at < whole.size(); at += 3) {
        std::string damaged = whole;
        damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
        test::write_raw(file_, damaged);
        try {
            const RadianceMap map = read_map(file_, small);
            ended += map.rgb.size() == 3 * map.width * map.height;
        } catch (const InputError&) {
            ++ended;
        }
    }
    EXPECT_EQ(ended, (whole.size() - 4 + 2) / 3);
}

TEST_F(ImageErrors, AbsurdSizesAreRefusedBeforeMemoryIsTaken) {
    test::write_test_exr(file_, {8, 4}, rgb_channels(test::ramp(std::size_t{3} * 8 * 4)));
    std::string bytes = test::read_file(file_);
    const std::string name("dataWindow\0box2i\0\x10\0\0\0", 21);
    const std::size_t at = bytes.find(name);
    ASSERT_NE(at, std::string::npos);
    const auto claim = [&](std::int32_t right, std::int32_t bottom) {
        const std::int32_t window[] = {0, 0, right, bottom};
        std::memcpy(bytes.data() + at + name.size(), window, sizeof(window));
        test::write_raw(file_, bytes);
    };
    rusage before{};
    getrusage(RUSAGE_SELF, &before);
    for (const auto& [right, bottom] : {std::pair{(1 << 30) - 1, (1 << 30) - 1},
                                        {(1 << 30) - 1, 3},
                                        {7, (1 << 30) - 1},
                                        {0x7fffffff, 0x7fffffff},
                                        {-2, 3},
                                        {7, -2},
                                        {(1 << 17) - 1, (1 << 17) - 1}}) {
        claim(right, bottom);
        refusal(file_);
    }
    rusage after{};
    getrusage(RUSAGE_SELF, &after);
    constexpr long spare_kib = 64 * 1024;  // the header's own structures: far below the smallest claim's 2 GB
    EXPECT_LT(after.ru_maxrss, before.ru_maxrss + spare_kib);
}

TEST_F(ImageErrors, LimitsAndMemoryAreSaidInNumbers) {
    test::write_test_exr(file_, {100, 50}, rgb_channels(test::ramp(std::size_t{3} * 100 * 50)));
    ReadOptions tight;
    tight.limits.max_bytes = 59999;
    EXPECT_THAT(refusal(file_, tight), HasSubstr("100 x 50 texels need 60 kB of memory and 60 kB are allowed"));
    tight.limits.max_bytes = 60000;
    EXPECT_EQ(read_map(file_, tight).width, 100U);
    tight.limits.max_texels = 4999;
    EXPECT_THAT(refusal(file_, tight), HasSubstr("claims 100 x 50 texels"));
    tight.limits = {};
    tight.limits.max_side = 99;
    EXPECT_THAT(refusal(file_, tight), HasSubstr("limits of 99 a side"));
}

TEST_F(ImageErrors, SubsampledColourIsRefused) {
    test::write_test_exr(file_, {8, 4}, rgb_channels(test::ramp(std::size_t{3} * 8 * 4), 2));
    EXPECT_THAT(refusal(file_), HasSubstr("channel R holds one value per 2 x 2 texels"));
}

/// OpenEXR decodes one spelling, at half the resolution, in the first part.
TEST_F(ImageErrors, ChromaThatCannotBeDecodedIsRefusedNotDropped) {
    const std::vector<float> grey = test::ramp(std::size_t{8} * 4);
    test::write_test_exr(file_, {8, 4},
                         {{"y", Imf::HALF, grey}, {"ry", Imf::HALF, grey, 2}, {"by", Imf::HALF, grey, 2}});
    EXPECT_THAT(refusal(file_), HasSubstr("luminance and chroma (y, ry, by)"));
    test::write_test_exr(file_, {8, 4}, {{"Y", Imf::HALF, grey}, {"RY", Imf::HALF, grey}, {"BY", Imf::HALF, grey}});
    EXPECT_THAT(refusal(file_), HasSubstr("channel RY holds one value per 1 x 1 texels"));
}

TEST_F(ImageErrors, AMissingOrForeignModuleIsSaid) {
    const fs::path tiff = folder_.path() / "map.tif";
    test::write_float_tiff(tiff, 2, 1, 3, test::ramp(6));
    ReadOptions without;
    without.oiio_module = folder_.path() / "absent.so";
    EXPECT_THAT(refusal(tiff, without), HasSubstr("absent.so"));
    without.oiio_module = fs::path(CLERESTORY_BUILD_DIR) / "libclerestory.so";
    EXPECT_THAT(refusal(tiff, without), HasSubstr("it is not this program's module"));
    for (const char* relative : {"clerestory_oiio.so", "./clerestory_oiio.so"}) {
        without.oiio_module = relative;
        EXPECT_THAT(refusal(tiff, without), HasSubstr("it is not there")) << "found only from some current folder";
    }
}

TEST_F(ImageErrors, AHeaderIsReadOfExrOnly) {
    test::write_raw(file_, "Dear reader");
    EXPECT_THROW(read_exr_header(file_), InputError);
    EXPECT_THROW(read_exr_header(folder_.path() / "absent.exr"), InputError);
}

TEST_F(ImageErrors, WhatAFormatCannotHoldIsNotWritten) {
    const unsigned char pixel[4] = {};
    EXPECT_THROW(write_png(folder_.path() / "a.png", 1, 1, 2, pixel), OutputError);
    EXPECT_THROW(write_png(folder_.path() / "a.png", 0, 1, 3, pixel), OutputError);
    const float rgba[4] = {};
    EXPECT_THROW(write_exr(file_, 0, 1, rgba, {}), OutputError);
    EXPECT_THROW(write_exr(file_, 1, 1, rgba, {{"compression", {"none", 0, false}}}), OutputError);
    EXPECT_THAT(test::names_in(folder_.path()), testing::IsEmpty());
}

}  // namespace
}  // namespace clerestory
