// An installed tree works wherever it is moved, and builds other programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "folder_watch.hpp"
#include "image.hpp"
#include "other_user.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;

class Install : public testing::Test {
  protected:
    /// Installs, then moves the tree, so that no path from before can be right.
    static void SetUpTestSuite() {
        folder_ = new TempFolder;
        const ProgramResult result =
            run_command({"cmake", "--install", CLERESTORY_BUILD_DIR, "--prefix", folder_->file("before")});
        ASSERT_EQ(result.exit_code, 0) << result.err;
        fs::rename(folder_->path() / "before", folder_->path() / "after");
        fs::create_directory(folder_->path() / "empty");
    }
    static void TearDownTestSuite() {
        delete folder_;
        folder_ = nullptr;
    }

    static fs::path tree() { return folder_->path() / "after"; }
    static ProgramSetting from_empty_folder() { return {.environment = {}, .folder = folder_->path() / "empty"}; }

    static inline TempFolder* folder_ = nullptr;
};

TEST_F(Install, TheMovedProgramFindsItsMaps) {
    const ProgramResult result = run_command({tree() / "bin/clerestory", "info", "--json", "-"}, from_empty_folder());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const fs::path map = nlohmann::json::parse(result.out)["file"].get<std::string>();
    EXPECT_EQ(map, fs::canonical(tree()) / "share/clerestory/data/city.exr");
}

TEST_F(Install, TheMovedProgramFindsItsModule) {
    const std::string png = folder_->file("map.png");
    write_png(png, 2, 1, 3, std::vector<unsigned char>(6, 7).data());
    const ProgramResult result = run_command({tree() / "bin/clerestory", "info", png}, from_empty_folder());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, testing::HasSubstr("2 x 1"));
}

/// Started by its bare name where somebody has laid out an installation of his own, with a module that leaves a proof.
TEST_F(Install, TheMovedProgramTakesNothingFromTheCurrentFolder) {
    const fs::path hostile = folder_->path() / "hostile";
    for (const char* home : {"", "clerestory", "lib/clerestory", CLERESTORY_LIB_FOLDER "/clerestory", "bin"}) {
        fs::create_directories(hostile / home / "programs");
        fs::copy_file(CLERESTORY_HOSTILE_MODULE, hostile / home / "clerestory_oiio.so",
                      fs::copy_options::overwrite_existing);
        const fs::path programs = tree() / CLERESTORY_LIB_FOLDER / "clerestory/programs";
        if (fs::exists(programs)) fs::copy(programs, hostile / home / "programs", fs::copy_options::overwrite_existing);
    }
    write_png(folder_->path() / "map.png", 2, 1, 3, std::vector<unsigned char>(6, 7).data());
    const FolderWatch watch(hostile);
    const std::string path = "PATH=" + (tree() / "bin").string() + ":/usr/bin:/bin";
    const ProgramResult result = run_command({"env", path, "clerestory", "info", folder_->file("map.png")},
                                             {.environment = {{"CLERESTORY_HOSTILE_PROOF", folder_->file("proof")},
                                                              {"CLERESTORY_CACHE_DIR", folder_->file("cache")}},
                                              .folder = hostile});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(watch.opened(), testing::IsEmpty());
    EXPECT_FALSE(fs::exists(folder_->path() / "proof"));
}

TEST_F(Install, NobodyElsesProgramsAreRunThoughTheyLieBesideOurs) {
    const fs::path programs = tree() / CLERESTORY_LIB_FOLDER / "clerestory/programs";
    if (!fs::exists(programs)) GTEST_SKIP() << "built without programs compiled ahead";
    if (!OtherUser::is_at_hand()) GTEST_SKIP() << "takes root to give files to another user";
    const auto kept = [](const std::string& cache) {
        const ProgramResult result = run_command(
            {tree() / "bin/clerestory", "fresnel", "-o", folder_->file("curves.csv")},
            {.environment = {{"CLERESTORY_CACHE_DIR", folder_->file(cache)}}, .folder = folder_->path() / "empty"});
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return names_in(folder_->path() / cache).size();
    };
    EXPECT_EQ(kept("ours"), 0U) << "nothing was compiled";
    for (const std::string& name : names_in(programs)) OtherUser::give(programs / name);
    EXPECT_GE(kept("theirs"), 2U) << "all was compiled anew";
    for (const std::string& name : names_in(programs)) ASSERT_EQ(lchown((programs / name).c_str(), 0, 0), 0);
}

TEST_F(Install, NoInstalledFileNamesThePlaceWhereItWasBuilt) {
    for (const auto& entry : fs::recursive_directory_iterator(tree())) {
        if (!entry.is_regular_file()) continue;
        EXPECT_EQ(read_file(entry.path()).find(CLERESTORY_SOURCE_DIR), std::string::npos) << entry.path();
    }
}

TEST_F(Install, PagesAndCompletionsLieWhereShellsLook) {
    for (const char* file : {"share/man/man1/clerestory.1.gz", "share/man/man1/clerestory-render.1.gz",
                             "share/bash-completion/completions/clerestory", "share/zsh/vendor-completions/_clerestory",
                             "share/fish/vendor_completions.d/clerestory.fish", "share/doc/clerestory/copyright"}) {
        EXPECT_TRUE(fs::is_regular_file(tree() / file)) << file;
    }
}

TEST_F(Install, TheExampleBuildsAgainstTheMovedTreeAndRuns) {
    const std::string build = folder_->file("build");
    const std::string prefix = "-DCMAKE_PREFIX_PATH=" + tree().string();
    const std::string source = std::string(CLERESTORY_SOURCE_DIR) + "/examples";
    const ProgramResult configured = run_command({"cmake", "-G", "Ninja", "-S", source, "-B", build, prefix});
    ASSERT_EQ(configured.exit_code, 0) << configured.err;
    const ProgramResult built = run_command({"cmake", "--build", build});
    ASSERT_EQ(built.exit_code, 0) << built.out;
    const ProgramResult run = run_command({build + "/sphere", "sphere.exr"}, from_empty_folder());
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.out, testing::HasSubstr("irradiance from above"));
    const Picture picture = read_picture(folder_->path() / "empty/sphere.exr");
    EXPECT_EQ(picture.width, 255U);
    EXPECT_GT(picture.rgb.at(3 * (127 * 255 + 127)), 0);
}

TEST(Example, RunsInTheBuildTree) {
    const TempFolder folder;
    const ProgramResult result = run_command({CLERESTORY_EXAMPLE, folder.file("sphere.png")});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"sphere.png"}));
    EXPECT_EQ(run_command({CLERESTORY_EXAMPLE}).exit_code, 2);
    EXPECT_EQ(run_command({CLERESTORY_EXAMPLE, folder.file("x.exr"), folder.file("missing.exr")}).exit_code, 3);
}

}  // namespace
}  // namespace clerestory::test
