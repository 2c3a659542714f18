// Where compiled kernels are kept for users without a cache folder that they can write to: services, containers, farms.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "run_program.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class Caches : public testing::Test {
  protected:
    /// Renders a small picture with nowhere to keep kernels but the temporary directory.
    ProgramResult render(const std::string& home, const std::string& named = "") {
        return run_program({"render", "-n", "8", "--size", "9", "-o", folder_.file("x.exr")},
                           {.environment = {{"HOME", home},
                                            {"XDG_CACHE_HOME", ""},
                                            {"CLERESTORY_CACHE_DIR", named},
                                            {"POCL_CACHE_DIR", named},
                                            {"TMPDIR", folder_.file("tmp")}}});
    }

    TempFolder folder_;
    fs::path temporary_ = folder_.path() / "tmp";
    fs::path own_ = temporary_ / fmt::format("clerestory-{}", geteuid());
    bool made_ = fs::create_directory(temporary_);
};

TEST_F(Caches, LieInTheTemporaryDirectoryWhereHomeCannotBeWrittenAndNobodyElseEntersThem) {
    for (const std::string home : {"/dev/null", "/proc/nowhere", ""}) {
        const auto result = render(home);
        EXPECT_EQ(result.exit_code, 0) << home << ": " << result.err;
        EXPECT_THAT(result.err, AllOf(HasSubstr("warning: "), HasSubstr(own_.string()))) << home;
        ASSERT_EQ(names_in(temporary_).size(), 1U) << home;
        EXPECT_EQ(fs::status(own_).permissions(), fs::perms::owner_all);
        EXPECT_FALSE(names_in(own_).empty());
        fs::remove_all(own_);
    }
    EXPECT_THAT(render("/dev/null").err, HasSubstr("/dev/null/.cache cannot be written: Not a directory"));
    EXPECT_THAT(render("").err, HasSubstr("neither HOME nor XDG_CACHE_HOME names a folder"));
}

TEST_F(Caches, AreNotSharedWithWhoeverMadeAFolderOfTheirName) {
    fs::create_directory(own_);
    fs::permissions(own_, fs::perms::all);
    EXPECT_EQ(render("/dev/null").exit_code, 0);
    EXPECT_TRUE(names_in(own_).empty());
    fs::remove(own_);
    fs::create_directory(folder_.path() / "elsewhere");
    fs::create_directory_symlink(folder_.path() / "elsewhere", own_);
    EXPECT_EQ(render("/dev/null").exit_code, 0);
    EXPECT_TRUE(names_in(folder_.path() / "elsewhere").empty());
}

TEST_F(Caches, ThatTheUserNamesAreTakenWithoutAWord) {
    const fs::path named = folder_.path() / "named";
    const auto result = render("/dev/null", named.string());
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.err, Not(HasSubstr("warning")));
    EXPECT_TRUE(names_in(temporary_).empty());
    EXPECT_FALSE(names_in(named).empty());
}

}  // namespace
}  // namespace clerestory::test
