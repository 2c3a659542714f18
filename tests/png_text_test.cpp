// Text in PNG files: how `batch --resume` knows its previews.
#include "map/png_text.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "image.hpp"
#include "image_files.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;

TEST(PngText, IsWrittenAndReadBack) {
    const TempFolder folder;
    const std::vector<unsigned char> pixels(3 * 4, 77);
    const std::string file = folder.file("a.png");
    const PngText text = {{"clerestory:digest", "0123"}, {"Title", "a b"}};
    write_png(file, 2, 2, 3, pixels.data(), text);
    EXPECT_EQ(read_png_text(file), text);
    fs::resize_file(file, fs::file_size(file) - 1);
    EXPECT_TRUE(read_png_text(file).empty()) << "cut short";
    write_png(file, 2, 2, 3, pixels.data());
    EXPECT_TRUE(read_png_text(file).empty());
    EXPECT_TRUE(read_png_text(folder.file("missing.png")).empty());
    write_raw(folder.path() / "tiny", "x");
    EXPECT_TRUE(read_png_text(folder.path() / "tiny").empty());
}

TEST(PngText, AnyByteOfAChunksHeadMayBeWrong) {
    const TempFolder folder;
    const std::vector<unsigned char> pixels(3 * 4, 77);
    const std::string file = folder.file("a.png");
    write_png(file, 2, 2, 3, pixels.data(), {{"clerestory:digest", "0123"}});
    const std::string whole = read_file(file);
    const std::size_t text = whole.find("tEXt");
    ASSERT_NE(text, std::string::npos);
    // Lengths beyond the file's end, and names that are none: no text, and no crash.
    for (std::size_t at = text - 4; at < text + 4; ++at) {
        for (const char wrong : {'\0', '\x7f', '\xff'}) {
            std::string damaged = whole;
            if (damaged[at] == wrong) continue;
            damaged[at] = wrong;
            write_raw(file, damaged);
            EXPECT_NE(read_png_text(file)["clerestory:digest"], "0123") << at;
        }
    }
}

}  // namespace
}  // namespace clerestory::test
