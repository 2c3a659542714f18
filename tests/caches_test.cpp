// Where compiled kernels are kept for users without a cache folder that they can write to: services, containers, farms.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "other_user.hpp"
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
        return run_program({"render", "-n", "8", "--size", "9", "-o", folder_.file("x.exr")}, setting(home, named));
    }

    /// Chooses the folders and says so, and compiles nothing: what is to be told of them costs no seconds.
    ProgramResult choose(const std::string& home, const std::string& named = "") {
        std::ofstream(folder_.file("jobs.toml")) << "[[job]]\nmap = \"jobs.toml\"\noutput = \"x.exr\"\n";
        return run_program({"batch", "--dry-run", folder_.file("jobs.toml")}, setting(home, named));
    }

    [[nodiscard]] ProgramSetting setting(const std::string& home, const std::string& named) const {
        return {.environment = {{"HOME", home},
                                {"XDG_CACHE_HOME", ""},
                                {"CLERESTORY_CACHE_DIR", named},
                                {"POCL_CACHE_DIR", named},
                                {"TMPDIR", folder_.file("tmp")}}};
    }

    TempFolder folder_;
    fs::path temporary_ = folder_.path() / "tmp";
    fs::path own_ = temporary_ / fmt::format("clerestory-{}", geteuid());
    bool made_ = fs::create_directory(temporary_);
};

TEST_F(Caches, LieInTheTemporaryDirectoryWhereHomeCannotBeWrittenAndNobodyElseEntersThem) {
    for (const std::string home : {"/proc/nowhere", "", "/dev/null"}) {
        const auto result = home == "/dev/null" ? render(home) : choose(home);
        EXPECT_EQ(result.exit_code, 0) << home << ": " << result.err;
        EXPECT_THAT(result.err, AllOf(HasSubstr("warning: "), HasSubstr(own_.string()))) << home;
        ASSERT_EQ(names_in(temporary_).size(), 1U) << home;
        EXPECT_EQ(fs::status(own_).permissions(), fs::perms::owner_all);
        EXPECT_EQ(names_in(own_).empty(), home != "/dev/null") << home;
        fs::remove_all(own_);
    }
    EXPECT_THAT(choose("/dev/null").err, HasSubstr("/dev/null/.cache/clerestory cannot be written: Not a directory"));
    EXPECT_THAT(choose("").err, HasSubstr("neither HOME nor XDG_CACHE_HOME names a folder"));
}

TEST_F(Caches, AreNotSharedWithWhoeverMadeAFolderOfTheirName) {
    fs::create_directory(own_);
    fs::permissions(own_, fs::perms::all);
    EXPECT_EQ(choose("/dev/null").exit_code, 0);
    EXPECT_TRUE(names_in(own_).empty());
    fs::remove(own_);
    fs::create_directory(folder_.path() / "elsewhere");
    fs::create_directory_symlink(folder_.path() / "elsewhere", own_);
    EXPECT_EQ(choose("/dev/null").exit_code, 0);
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

/// Permissions of a folder's whole tree that let anybody but its owner in.
std::vector<std::string> open_to_others(const fs::path& folder) {
    std::vector<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        const auto mode = entry.symlink_status().permissions();
        if ((mode & (fs::perms::group_all | fs::perms::others_all)) != fs::perms::none) found.push_back(entry.path());
    }
    return found;
}

TEST_F(Caches, AreTheUsersAloneWhateverTheUmask) {
    const fs::path home = folder_.path() / "home";
    fs::create_directory(home);
    const mode_t before = umask(0);
    const auto result = render(home.string());
    umask(before);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, Not(HasSubstr("warning")));
    EXPECT_THAT(names_in(home / ".cache"), testing::ElementsAre("clerestory", "pocl"));
    EXPECT_THAT(open_to_others(home), testing::IsEmpty());
    EXPECT_EQ(fs::status(folder_.file("x.exr")).permissions(), fs::perms(0666)) << "a result follows the umask";
}

TEST_F(Caches, InAFolderThatAllShareAreOnesOwn) {
    const fs::path shared = folder_.path() / "shared";
    fs::create_directory(shared);
    ASSERT_EQ(chmod(shared.c_str(), 01777), 0);
    const auto result = choose("/dev/null", shared.string());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, Not(HasSubstr("warning")));
    const std::string own = fmt::format("clerestory-{}", geteuid());
    EXPECT_THAT(names_in(shared), testing::ElementsAre(own));
    EXPECT_EQ(fs::status(shared / own).permissions(), fs::perms::owner_all);
}

TEST_F(Caches, DoNotLieWhereOthersCanWrite) {
    const fs::path home = folder_.path() / "home";
    fs::create_directories(home / ".cache/pocl");
    for (const fs::path& open : {home, home / ".cache", home / ".cache/pocl"}) {
        fs::remove_all(own_);
        const mode_t mode = static_cast<mode_t>(fs::status(open).permissions());
        ASSERT_EQ(chmod(open.c_str(), 0777), 0);
        const auto result = choose(home.string());
        EXPECT_EQ(result.exit_code, 0) << result.err;
        EXPECT_THAT(result.err,
                    AllOf(HasSubstr("is not used: others can write to " + open.string()), HasSubstr(own_.string())));
        ASSERT_EQ(chmod(open.c_str(), mode), 0);
    }
    fs::create_directory(folder_.path() / "open");
    ASSERT_EQ(chmod(folder_.file("open").c_str(), 0777), 0);
    const auto result = choose(home.string(), folder_.file("open"));
    EXPECT_THAT(result.err,
                AllOf(HasSubstr("others can write to " + folder_.file("open")), HasSubstr((home / ".cache").string())));
    EXPECT_TRUE(names_in(folder_.path() / "open").empty());
}

TEST_F(Caches, OfPoclAreNeverFoundFromTheCurrentFolder) {
    fs::create_directory(folder_.path() / "work");
    const auto result = run_program({"render", "-n", "8", "--size", "9", "-o", folder_.file("x.exr")},
                                    {.environment = {{"POCL_CACHE_DIR", "kernels"},
                                                     {"CLERESTORY_CACHE_DIR", "kernels"},
                                                     {"HOME", folder_.path().string()},
                                                     {"XDG_CACHE_HOME", ""}},
                                     .folder = folder_.path() / "work"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(names_in(folder_.path() / "work").empty());
}

class CachesAmongUsers : public Caches {
  protected:
    void SetUp() override {
        if (!OtherUser::is_at_hand()) GTEST_SKIP() << "takes root to give files to another user";
    }
};

TEST_F(CachesAmongUsers, OfPoclAreNotAnotherUsersFolderInTheTemporaryDirectory) {
    ASSERT_EQ(chmod(temporary_.c_str(), 01777), 0);
    for (const std::string& name : {std::string("pocl"), own_.filename().string()}) {
        fs::create_directory(temporary_ / name);
        ASSERT_EQ(chmod((temporary_ / name).c_str(), 0777), 0);
        OtherUser::give(temporary_ / name);
    }
    const auto result = render("");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(names_in(temporary_ / "pocl").empty());
    EXPECT_TRUE(names_in(own_).empty());
}

/// Root fills a folder for all: its entries are used, and none are added.
TEST_F(CachesAmongUsers, ThatRootHasFilledAreReadByOthers) {
    const fs::path filled = folder_.path() / "filled";
    fs::create_directory(filled);
    fs::permissions(folder_.path(), fs::perms(0755));
    std::ofstream(folder_.file("jobs.toml")) << "[[job]]\nmap = \"jobs.toml\"\noutput = \"x.exr\"\n";
    const fs::path home = folder_.path() / "home";
    fs::create_directory(home);
    OtherUser::give(home);
    const fs::path program = folder_.path() / "clerestory";  // the build folder may be root's alone
    fs::copy_file(CLERESTORY_PROGRAM, program);
    const auto result =
        run_command(OtherUser::words_for({program.string(), "batch", "--dry-run", folder_.file("jobs.toml")}),
                    {.environment = {{"HOME", home.string()},
                                     {"XDG_CACHE_HOME", ""},
                                     {"CLERESTORY_CACHE_DIR", filled.string()},
                                     {"POCL_CACHE_DIR", ""}},
                     .folder = "/"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, Not(HasSubstr("warning")));
    EXPECT_THAT(names_in(home / ".cache"), testing::ElementsAre("pocl")) << "no need of another place";
}

TEST_F(CachesAmongUsers, ThatAreNamedAndAnotherUsersAreNotUsed) {
    const fs::path named = folder_.path() / "named";
    fs::create_directory(named);
    OtherUser::give(named);
    const auto result = choose("/dev/null", named.string());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr(named.string() + " belongs to user 65534"));
    EXPECT_TRUE(names_in(named).empty());
}

}  // namespace
}  // namespace clerestory::test
