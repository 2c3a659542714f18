// Programs compiled ahead: what a copy of the tool finds beside itself it need not compile, and it never depends on it.
#include "cl/precompiled.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "cl/device.hpp"
#include "cl/program.hpp"
#include "other_user.hpp"
#include "run_program.hpp"
#include "test_device.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;

TEST(Precompiled, KeepsEachProgramOnceItsDeviceIsClosed) {
    const TempFolder folder;
    {
        const TestDevice device({}, {.precompile_into = folder.path()});
        const Program display(device, "display.cl");
        const Program sequence(device, "sequence.cl");
        EXPECT_TRUE(names_in(folder.path()).empty()) << "kernels may still run";
    }
    EXPECT_EQ(names_in(folder.path()).size(), 2U);
}

/// A copy of the program with nothing beside it, and caches of its own.
class PrecompiledCopy : public testing::Test {
  protected:
    void SetUp() override { fs::copy_file(CLERESTORY_PROGRAM, folder_.path() / "clerestory"); }

    /// The curves that it writes, from empty caches.
    std::string curves(const std::string& precompile_into = "") {
        for (const char* cache : {"pocl", "cache"}) {
            fs::remove_all(folder_.path() / cache);
            fs::create_directory(folder_.path() / cache);
        }
        const ProgramResult result =
            run_command({folder_.file("clerestory"), "fresnel", "-o", folder_.file("curves.csv")},
                        {.environment = {{"POCL_CACHE_DIR", folder_.file("pocl")},
                                         {"CLERESTORY_CACHE_DIR", folder_.file("cache")},
                                         {"CLERESTORY_PRECOMPILE_DIR", precompile_into}}});
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return read_file(folder_.path() / "curves.csv");
    }
    /// Whether the last run compiled a program: then it kept it.
    bool compiled() { return !names_in(folder_.path() / "cache").empty(); }

    TempFolder folder_;
};

TEST_F(PrecompiledCopy, CompilesWhatDoesNotLieBesideItOrIsDamagedOrOfAnotherKernel) {
    const std::string expected = curves(folder_.file("programs"));
    EXPECT_TRUE(compiled());
    const fs::path programs = folder_.path() / "programs";
    EXPECT_GE(names_in(programs).size(), 2U);  // the curves' kernel, and what the device answered
    EXPECT_EQ(curves(), expected);
    EXPECT_FALSE(compiled());

    for (const std::string& name : names_in(programs)) {
        fs::copy_file(programs / name, programs / ("other_" + name));
        fs::resize_file(programs / name, fs::file_size(programs / name) - 1);
    }
    EXPECT_EQ(curves(), expected);
    EXPECT_TRUE(compiled());
    for (const std::string& name : names_in(programs)) {
        if (!name.starts_with("other_")) fs::remove(programs / name);
    }
    EXPECT_EQ(curves(), expected);
    EXPECT_TRUE(compiled());
}

/// Built programs beside the copy, as somebody else might have put them there.
TEST_F(PrecompiledCopy, RunsNobodyElsesPrograms) {
    const fs::path programs = folder_.path() / "programs";
    if (CLERESTORY_PRECOMPILED) {
        fs::copy(fs::path(CLERESTORY_BUILD_DIR) / "programs", programs);
    } else {
        curves(programs);
    }
    const auto are_used = [this] {
        curves();
        return !compiled();
    };
    EXPECT_TRUE(are_used());
    fs::permissions(programs, fs::perms::all);
    EXPECT_FALSE(are_used()) << "anybody could have written them";
    fs::permissions(programs, fs::perms(0755));
    if (!OtherUser::is_at_hand()) return;
    for (const std::string& name : names_in(programs)) OtherUser::give(programs / name);
    EXPECT_FALSE(are_used()) << "another user's";
    OtherUser::give(folder_.path() / "clerestory");
    EXPECT_TRUE(are_used()) << "whose program this is";
}

TEST(Precompiled, IsAPartOfThisBuild) {
    if (!CLERESTORY_PRECOMPILED) GTEST_SKIP() << "built without";
    EXPECT_GE(names_in(fs::path(CLERESTORY_BUILD_DIR) / "programs").size(), 8U);
}

}  // namespace
}  // namespace clerestory::test
