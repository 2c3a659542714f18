// Whose files are believed: built kernels and modules are code.
#include "base/trust.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "image_files.hpp"
#include "other_user.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::size_t ENOUGH = 100;

class TrustTest : public testing::Test {
  protected:
    TrustTest() {
        fs::create_directories(folder_.path() / "a/b");
        write_raw(entry_, "code");
    }
    [[nodiscard]] std::optional<std::string> read() const { return Trust().read(entry_, ENOUGH); }

    TempFolder folder_;
    fs::path entry_ = folder_.path() / "a/b/entry";
};

TEST_F(TrustTest, AFileOfMineInFoldersOfMineIsRead) {
    EXPECT_EQ(read(), "code");
    EXPECT_THAT(Trust().doubt_of_file(entry_), IsEmpty());
    write_raw(entry_, "");
    EXPECT_EQ(read(), "");
}

TEST_F(TrustTest, NotWhereOthersCanWriteToItOrToAFolderAboveIt) {
    for (const fs::path& path : {entry_, entry_.parent_path(), entry_.parent_path().parent_path()}) {
        for (const mode_t bit : {mode_t{S_IWGRP}, mode_t{S_IWOTH}}) {
            struct stat before {};
            ASSERT_EQ(stat(path.c_str(), &before), 0);
            ASSERT_EQ(chmod(path.c_str(), before.st_mode | bit), 0);
            EXPECT_FALSE(read()) << path << " " << bit;
            EXPECT_THAT(Trust().doubt_of_file(entry_), HasSubstr("others can write to ")) << path;
            ASSERT_EQ(chmod(path.c_str(), before.st_mode), 0);
            EXPECT_TRUE(read());
        }
    }
}

TEST_F(TrustTest, AStickyFolderWillDoForAFileButNotForWhatIsNotLookedAt) {
    const fs::path folder = entry_.parent_path();
    ASSERT_EQ(chmod(folder.c_str(), 01777), 0);
    EXPECT_TRUE(read());
    EXPECT_THAT(Trust().doubt_of_folder(folder, true), IsEmpty());
    EXPECT_THAT(Trust().doubt_of_folder(folder, false), HasSubstr("others can write to " + folder.string()));
    fs::create_directory(folder / "below");
    EXPECT_THAT(Trust().doubt_of_folder(folder / "below", false), IsEmpty()) << "others cannot rename it";
}

TEST_F(TrustTest, NothingButARegularFileIsReadAndNothingIsWaitedFor) {
    fs::remove(entry_);
    EXPECT_FALSE(read()) << "nothing";
    fs::create_directory(entry_);
    EXPECT_FALSE(read()) << "a folder";
    fs::remove(entry_);
    ASSERT_EQ(mkfifo(entry_.c_str(), 0600), 0);
    EXPECT_FALSE(read()) << "a pipe that nobody writes to";
    fs::remove(entry_);
    write_raw(folder_.path() / "mine", "code");
    fs::create_symlink(folder_.path() / "mine", entry_);
    EXPECT_FALSE(read()) << "a link";
    EXPECT_FALSE(Trust().read("/dev/zero", ENOUGH));
    EXPECT_FALSE(Trust().read(folder_.path() / "missing/entry", ENOUGH));
}

TEST_F(TrustTest, AFileThatIsTooLongIsNotRead) {
    EXPECT_FALSE(Trust().read(entry_, 3));
    EXPECT_TRUE(Trust().read(entry_, 4));
    fs::resize_file(entry_, std::uintmax_t{1} << 40);  // a hole
    EXPECT_FALSE(read());
}

TEST_F(TrustTest, LinksToFoldersAreFollowed) {
    fs::create_directory_symlink(folder_.path() / "a", folder_.path() / "link");
    EXPECT_EQ(Trust().read(folder_.path() / "link/b/entry", ENOUGH), "code");
}

TEST_F(TrustTest, FoldersThatHoldTheProgramAreNotAsked) {
    const fs::path program = folder_.path() / "a/program";
    write_raw(program, "");
    ASSERT_EQ(chmod((folder_.path() / "a").c_str(), 0777), 0);
    EXPECT_FALSE(read());
    EXPECT_TRUE(Trust::beside(program).read(entry_, ENOUGH)) << "who can replace it can replace the program";
    ASSERT_EQ(chmod((folder_.path() / "a/b").c_str(), 0777), 0);
    EXPECT_FALSE(Trust::beside(program).read(entry_, ENOUGH)) << "but not this one";
}

TEST_F(TrustTest, WhatIsAsOpenAsTheProgramItselfIsReadBesideIt) {
    const fs::path program = folder_.path() / "a/program";
    write_raw(program, "");
    for (const fs::path& path : {entry_, entry_.parent_path(), program}) {
        EXPECT_EQ(Trust::beside(program).read(entry_, ENOUGH).has_value(), path == entry_) << path;
        ASSERT_EQ(chmod(path.c_str(), 0777), 0);
    }
    EXPECT_TRUE(Trust::beside(program).read(entry_, ENOUGH));
    EXPECT_FALSE(read());
}

class TrustAmongUsers : public TrustTest {
  protected:
    void SetUp() override {
        if (!OtherUser::is_at_hand()) GTEST_SKIP() << "takes root to give files to another user";
    }
};

TEST_F(TrustAmongUsers, NothingOfAnotherUserIsRead) {
    for (const fs::path& path : {entry_, entry_.parent_path(), entry_.parent_path().parent_path()}) {
        OtherUser::give(path);
        EXPECT_FALSE(read()) << path;
        EXPECT_THAT(Trust().doubt_of_file(entry_), HasSubstr(fmt::format("belongs to user {}", OtherUser::ID))) << path;
        ASSERT_EQ(lchown(path.c_str(), 0, 0), 0);
    }
    EXPECT_TRUE(read());
}

TEST_F(TrustAmongUsers, WhatTheProgramsOwnerHasBesideItIsRead) {
    const fs::path program = folder_.path() / "a/program";
    write_raw(program, "");
    OtherUser::give(entry_);
    EXPECT_FALSE(Trust::beside(program).read(entry_, ENOUGH));
    OtherUser::give(program);
    EXPECT_TRUE(Trust::beside(program).read(entry_, ENOUGH));
    EXPECT_FALSE(read());
}

}  // namespace
}  // namespace clerestory::test
