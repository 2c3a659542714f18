#include "bundled.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <string>

#include "error.hpp"
#include "image.hpp"
#include "run_program.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

const fs::path DATA = fs::path(CLERESTORY_SOURCE_DIR) / "data";

std::string sha256(const fs::path& file) {
    const std::string command = "sha256sum '" + file.string() + "'";
    FILE* pipe = popen(command.c_str(), "r");
    std::array<char, 64> digest{};
    const std::size_t read = pipe ? fread(digest.data(), 1, digest.size(), pipe) : 0;
    if (pipe) pclose(pipe);
    return {digest.data(), read};
}

TEST(Bundled, EveryMapIsTheOneThatTheReadmeNames) {
    const std::string readme = test::read_file(DATA / "README.md");
    for (const std::string& name : bundled_map_names()) {
        const fs::path file = bundled_map(name);
        const std::string digest = sha256(file);
        ASSERT_EQ(digest.size(), 64U);
        EXPECT_THAT(readme, testing::HasSubstr(fmt::format(" {} | `{}`", fs::file_size(file), digest))) << name;
    }
}

TEST(Bundled, TheMapsAreThree) {
    EXPECT_THAT(bundled_map_names(), testing::ElementsAre("city", "interior", "sunset"));
    EXPECT_TRUE(fs::equivalent(bundled_map(), DATA / "city.exr"));
}

/// What data/README.md says of each: its size, the sky above, and how many values the compression had made negative.
TEST(Bundled, EveryMapIsFitToRender) {
    for (const auto& [name, ringing] :
         {std::pair<std::string, std::size_t>{"city", 506}, {"interior", 8980}, {"sunset", 5}}) {
        const RadianceMap map = read_map(bundled_map(name), {});
        EXPECT_EQ(map.width, 1024U);
        EXPECT_EQ(map.height, 512U);
        EXPECT_EQ(map.ringing, ringing) << name;
        const float* end = map.rgb.data() + map.rgb.size();
        EXPECT_TRUE(std::all_of(map.rgb.data(), end, [](float v) { return v >= 0.0F && v < 65504.0F; })) << name;
        const auto mean = [&](std::size_t first_row) {
            double sum = 0;
            for (std::size_t i = 0; i < 3 * 1024 * 64; ++i) sum += map.rgb[3 * 1024 * first_row + i];
            return sum / (3 * 1024 * 64);
        };
        EXPECT_GT(mean(0), mean(512 - 64)) << name;
    }
}

TEST(Bundled, AnUnknownNameIsRefusedWithThoseThatExist) {
    try {
        bundled_map("moon");
        FAIL();
    } catch (const InputError& e) {
        EXPECT_STREQ(e.what(), "moon: no map of that name comes with the program; it has city, interior, sunset");
    }
}

}  // namespace
}  // namespace clerestory
