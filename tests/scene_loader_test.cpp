#include "render/scene_loader.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "error.hpp"
#include "image_files.hpp"
#include "run_program.hpp"
#include "test_device.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;

/// A map that is decoded in several bands.
constexpr std::size_t WIDTH = 2048;
constexpr std::size_t HEIGHT = 3001;

class SceneLoaderTest : public testing::Test {
  protected:
    /// Writes `rgb` [3 * HEIGHT * WIDTH] as the map.
    void write(const std::vector<float>& rgb) {
        std::vector<ExrChannel> channels;
        for (std::size_t c = 0; c < 3; ++c) channels.push_back({std::string(1, "RGB"[c]), Imf::FLOAT, channel(rgb, c)});
        write_test_exr(file_, {WIDTH, HEIGHT}, channels);
    }
    std::unique_ptr<Scene> load(bool flip_y = false, BadTexels bad_texels = BadTexels::refuse) {
        SceneLoader loader(file_, read_options(flip_y), {.tables = {}, .bad_texels = bad_texels});
        auto scene = loader.finish(device_, builder_);
        EXPECT_GT(loader.read_seconds(), 0);
        EXPECT_GT(scene->build_seconds(), 0);
        return scene;
    }
    static ReadOptions read_options(bool flip_y) {
        ReadOptions read;
        read.flip_y = flip_y;
        return read;
    }
    /// What an InputError of loading says.
    std::string refusal() {
        try {
            load();
        } catch (const InputError& error) {
            return error.what();
        }
        return "nothing was refused";
    }
    void expect_refused(const std::string& why) {
        const std::string said = refusal();
        EXPECT_EQ(said.rfind(file_ + ": ", 0), 0U) << said;
        EXPECT_EQ(said.find(file_, 1), std::string::npos) << "named twice: " << said;
        EXPECT_THAT(said, testing::HasSubstr(why));
    }

    TempFolder folder_;
    const std::string file_ = folder_.file("map.exr");
    TestDevice device_;
    TableBuilder builder_{device_};
};

TEST_F(SceneLoaderTest, TablesBuiltBehindTheReaderAreThoseOfTheWholeMap) {
    write(ramp(3 * WIDTH * HEIGHT));
    for (const bool flip_y : {false, true}) {
        const auto scene = load(flip_y);
        const Scene whole(device_, builder_, read_map(file_, read_options(flip_y)));
        EXPECT_EQ(scene->distribution().conditional.download(), whole.distribution().conditional.download());
        EXPECT_EQ(scene->distribution().conditional_guide.download(),
                  whole.distribution().conditional_guide.download());
        EXPECT_EQ(scene->distribution().marginal.download(), whole.distribution().marginal.download());
        EXPECT_EQ(scene->distribution().phi, whole.distribution().phi);
        EXPECT_EQ(scene->device_map().radiance.download(), whole.device_map().radiance.download());
    }
}

TEST_F(SceneLoaderTest, ABadTexelInTheLastRowIsToldOrRepaired) {
    std::vector<float> rgb = ramp(3 * WIDTH * HEIGHT);
    rgb.back() = std::numeric_limits<float>::quiet_NaN();
    write(rgb);
    expect_refused("1 NaN, 0 infinite and 0 negative texels, the first at row 3000, column 2047");
    const auto scene = load(false, BadTexels::zero);
    EXPECT_EQ(scene->repaired(), 1U);
    EXPECT_EQ(scene->map().rgb[3 * WIDTH * HEIGHT - 1], 0);
    EXPECT_EQ(scene->distribution().counts.bad(), 0U);
}

TEST_F(SceneLoaderTest, AFileCutShortIsRefusedWhateverWasBuilt) {
    write(ramp(3 * WIDTH * HEIGHT));
    fs::resize_file(file_, fs::file_size(file_) * 9 / 10);
    expect_refused("cut short");
    fs::remove(file_);
    expect_refused("no such file");
}

TEST_F(SceneLoaderTest, ATinyMapAndABlackOneAreBuilt) {
    write_test_exr(file_, {1, 1}, {{"Y", Imf::HALF, {2.0F}}});
    EXPECT_FALSE(load()->distribution().black());
    write_test_exr(file_, {3, 2}, {{"Y", Imf::HALF, std::vector<float>(6, 0.0F)}});
    EXPECT_TRUE(load()->distribution().black());
}

TEST_F(SceneLoaderTest, OneThatNobodyFinishesEnds) {
    write(ramp(3 * WIDTH * HEIGHT));
    const SceneLoader loader(file_, {}, {});
}

}  // namespace
}  // namespace clerestory::test
