#include "base/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/xattr.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "error.hpp"
#include "image.hpp"
#include "image_files.hpp"
#include "other_user.hpp"
#include "run_program.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class AtomicFileTest : public testing::Test {
  protected:
    test::TempFolder folder_;
};

/// While it lives a file can grow to `bytes` only, as on a disk that becomes full.
class FileSizeLimit {
  public:
    explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
        getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit small{bytes, before_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &small);
    }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;
    ~FileSizeLimit() {
        setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }

  private:
    rlimit before_{};
    void (*handler_)(int);
};

std::span<const char> bytes_of(std::string_view text) { return {text.data(), text.size()}; }

TEST_F(AtomicFileTest, TheTargetAppearsOnlyAtCommit) {
    const fs::path target = folder_.path() / "a.txt";
    {
        AtomicFile file(target);
        file.write(bytes_of("who"));
        file.write(bytes_of("le"));
        EXPECT_FALSE(fs::exists(target));
        EXPECT_EQ(test::names_in(folder_.path()).size(), 1U);
        file.commit();
    }
    EXPECT_EQ(test::read_file(target), "whole");
    EXPECT_THAT(test::names_in(folder_.path()), ElementsAre("a.txt"));
}

TEST_F(AtomicFileTest, WithoutCommitNothingIsLeftNotEvenTheFoldersItMade) {
    const fs::path target = folder_.path() / "new/deeper/a.txt";
    {
        const AtomicFile file(target);
        EXPECT_TRUE(fs::exists(target.parent_path()));
    }
    EXPECT_THAT(test::names_in(folder_.path()), IsEmpty());
}

TEST_F(AtomicFileTest, TextIsWrittenIntoFoldersThatDidNotExist) {
    write_text(folder_.path() / "new/deeper/a.txt", "text");
    EXPECT_EQ(test::read_file(folder_.path() / "new/deeper/a.txt"), "text");
}

TEST_F(AtomicFileTest, ThroughALinkTheFileItPointsToIsReplaced) {
    write_text(folder_.path() / "real.txt", "old");
    fs::create_symlink("real.txt", folder_.path() / "link.txt");
    write_text(folder_.path() / "link.txt", "new");
    EXPECT_TRUE(fs::is_symlink(folder_.path() / "link.txt"));
    EXPECT_EQ(test::read_file(folder_.path() / "real.txt"), "new");
}

TEST_F(AtomicFileTest, ADeviceIsWrittenNotReplaced) {
    write_text("/dev/null", "text");
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

/// The message of the OutputError that `write` must throw.
template <class Write>
std::string failure_of(Write write) {
    try {
        write();
    } catch (const OutputError& e) {
        EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
        return e.what();
    }
    ADD_FAILURE() << "nothing was thrown";
    return {};
}

TEST_F(AtomicFileTest, AFullDiskIsNoticedAndTheOldFileKept) {
    const std::vector<float> rgba = test::ramp(std::size_t{4} * 64 * 64);
    const std::vector<unsigned char> bytes(std::size_t{3} * 512 * 512, 7);
    const fs::path text = folder_.path() / "a.txt";
    write_text(text, "old");
    {
        const FileSizeLimit full(100);
        EXPECT_THAT(failure_of([&] { write_text(text, std::string(200, 'x')); }), HasSubstr("a.txt: could not write"));
        failure_of([&] { write_exr(folder_.path() / "a.exr", 64, 64, rgba.data(), {}); });
        failure_of([&] { write_png(folder_.path() / "new/a.png", 512, 512, 3, bytes.data()); });
    }
    EXPECT_EQ(test::read_file(text), "old");
    EXPECT_THAT(test::names_in(folder_.path()), ElementsAre("a.txt"));
    EXPECT_THAT(failure_of([] { write_text("/dev/full", "x"); }), HasSubstr("free some space"));
}

TEST_F(AtomicFileTest, APathThatCannotBeWrittenIsSaidInOneLine) {
    write_text(folder_.path() / "file", "text");
    EXPECT_THAT(failure_of([&] { write_text(folder_.path() / "file/below.txt", "x"); }),
                HasSubstr("is a file, not a folder"));
    EXPECT_THAT(failure_of([&] { write_text(folder_.path(), "x"); }), HasSubstr("directory"));
    EXPECT_THAT(failure_of([&] { write_text(folder_.path() / "", "x"); }), HasSubstr("directory"));
    // Nobody, root included, makes files in /proc.
    EXPECT_THAT(failure_of([&] { write_text("/proc/clerestory/a.txt", "x"); }), HasSubstr("could not make the folder"));
    EXPECT_THAT(failure_of([&] { write_text("/proc/a.txt", "x"); }), HasSubstr("could not create"));
    EXPECT_THAT(test::names_in(folder_.path()), ElementsAre("file"));
}

TEST_F(AtomicFileTest, LeftoversOfLivingWritersStay) {
    test::write_raw(folder_.path() / ".clerestory-0123456789abcdef.part", "half a picture");
    test::write_raw(folder_.path() / "picture.exr", "a picture");
    const AtomicFile living(folder_.path() / "other.exr");
    EXPECT_EQ(remove_abandoned(folder_.path()), 1U);
    EXPECT_EQ(remove_abandoned(folder_.path() / "missing"), 0U);
    EXPECT_EQ(test::names_in(folder_.path()).size(), 2U) << "the picture and the one that is being written";
}

TEST_F(AtomicFileTest, OnlyItsOwnLeftoversAreRemoved) {
    const std::vector<std::string> others = {".clerestory-notes.parts",
                                             ".clerestory-0123456789abcde.part",
                                             ".clerestory-0123456789abcdefg.part",
                                             ".clerestory-0123456789ABCDEF.part",
                                             ".clerestory-0123456789abcdef.part.exr",
                                             "x.clerestory-0123456789abcdef.part"};
    for (const std::string& name : others) test::write_raw(folder_.path() / name, "somebody's");
    fs::create_directory(folder_.path() / ".clerestory-0000000000000000.part");
    fs::create_symlink(others.front(), folder_.path() / ".clerestory-0000000000000001.part");
    ASSERT_EQ(mkfifo((folder_.path() / ".clerestory-0000000000000002.part").c_str(), 0600), 0);
    EXPECT_EQ(remove_abandoned(folder_.path()), 0U);
    EXPECT_EQ(test::names_in(folder_.path()).size(), others.size() + 3);
}

mode_t mode_of(const fs::path& file) {
    struct stat state {};
    return stat(file.c_str(), &state) == 0 ? state.st_mode & 07777 : 0;
}

TEST_F(AtomicFileTest, AFileThatIsReplacedKeepsItsPermissions) {
    const fs::path file = folder_.path() / "a.txt";
    for (const mode_t mode : {0600U, 0640U, 0664U, 0444U, 0200U}) {
        write_text(file, "old");
        ASSERT_EQ(chmod(file.c_str(), mode), 0);
        write_text(file, "new");
        EXPECT_EQ(mode_of(file), mode);
        fs::remove(file);
    }
}

TEST_F(AtomicFileTest, AnAccessListIsKeptAndNoneIsInherited) {
    const fs::path file = folder_.path() / "a.txt";
    write_text(file, "old");
    // Version 2; user rw, user 65534 r, group r, mask r, others nothing: acl(5) as the kernel stores it.
    const std::string list(
        "\2\0\0\0\1\0\6\0\377\377\377\377\2\0\4\0\376\377\0\0\4\0\4\0\377\377\377\377\20\0\4\0\377\377\377\377\40\0\0\0"
        "\377\377\377\377",
        44);
    if (setxattr(file.c_str(), "system.posix_acl_access", list.data(), list.size(), 0) != 0) {
        GTEST_SKIP() << "no access lists here: " << std::strerror(errno);
    }
    write_text(file, "new");
    std::string kept(100, '\0');
    const ssize_t size = getxattr(file.c_str(), "system.posix_acl_access", kept.data(), kept.size());
    ASSERT_GT(size, 0);
    EXPECT_EQ(kept.substr(0, static_cast<std::size_t>(size)), list);
    ASSERT_EQ(removexattr(file.c_str(), "system.posix_acl_access"), 0);
    ASSERT_EQ(chmod(file.c_str(), 0640), 0);
    ASSERT_EQ(setxattr(folder_.path().c_str(), "system.posix_acl_default", list.data(), list.size(), 0), 0);
    write_text(file, "new");
    EXPECT_EQ(mode_of(file), 0640);
    EXPECT_LT(getxattr(file.c_str(), "system.posix_acl_access", kept.data(), kept.size()), 0);
}

TEST_F(AtomicFileTest, WhoReadsANewFileIsTheUmasksOrTheOwnersOrEverybodysAffair) {
    const mode_t before = umask(0);
    write_text(folder_.path() / "u/a", "x", Readers::umask);
    write_text(folder_.path() / "o/a", "x", Readers::owner);
    umask(077);
    write_text(folder_.path() / "e/a", "x", Readers::everyone);
    umask(before);
    EXPECT_EQ(mode_of(folder_.path() / "u/a"), 0666);
    EXPECT_EQ(mode_of(folder_.path() / "u"), 0777);
    EXPECT_EQ(mode_of(folder_.path() / "o/a"), 0600);
    EXPECT_EQ(mode_of(folder_.path() / "o"), 0700);
    EXPECT_EQ(mode_of(folder_.path() / "e/a"), 0644);
    EXPECT_EQ(mode_of(folder_.path() / "e"), 0755);
}

TEST_F(AtomicFileTest, LinksLeadOnWhateverTheirKind) {
    fs::create_directories(folder_.path() / "real/deep");
    fs::create_directory_symlink("real/deep", folder_.path() / "relative");
    fs::create_directory_symlink(folder_.path() / "relative", folder_.path() / "absolute");
    fs::create_symlink("../new/dangling.txt", folder_.path() / "real/deep/link.txt");
    write_text(folder_.path() / "absolute/../deep/./link.txt", "through");
    EXPECT_EQ(test::read_file(folder_.path() / "real/new/dangling.txt"), "through");
    EXPECT_TRUE(fs::is_symlink(folder_.path() / "real/deep/link.txt"));
    fs::create_symlink("loop.txt", folder_.path() / "loop.txt");
    EXPECT_THAT(failure_of([&] { write_text(folder_.path() / "loop.txt", "x"); }), HasSubstr("symbolic links"));
}

TEST_F(AtomicFileTest, AnOpenFileIsWrittenAtItsEndNotReplaced) {
    const fs::path file = folder_.path() / "open.txt";
    test::write_raw(file, "before ");
    const Descriptor open(::open(file.c_str(), O_RDWR | O_CLOEXEC));
    write_text(fmt::format("/proc/self/fd/{}", open.get()), "after");
    EXPECT_EQ(test::read_file(file), "before after");
}

class AtomicFileAmongUsers : public AtomicFileTest {
  protected:
    void SetUp() override {
        if (!test::OtherUser::is_at_hand()) GTEST_SKIP() << "takes root to give files to another user";
    }
};

TEST_F(AtomicFileAmongUsers, ALinkOfSomebodyElsesIsNotFollowed) {
    const fs::path mine = folder_.path() / "mine.txt";
    const fs::path link = folder_.path() / "link.txt";
    write_text(mine, "mine");
    fs::create_symlink(mine, link);
    test::OtherUser::give(link);
    EXPECT_THAT(failure_of([&] { write_text(link, "x"); }), HasSubstr("link.txt is a link of user 65534"));
    fs::create_symlink(link, folder_.path() / "indirect.txt");
    EXPECT_THAT(failure_of([&] { write_text(folder_.path() / "indirect.txt", "x"); }),
                HasSubstr("a link of user 65534"));
    EXPECT_EQ(test::read_file(mine), "mine");
}

TEST_F(AtomicFileAmongUsers, InAFolderThatAllShareNobodysLinksAndPipesAreUsedButOnesOwn) {
    const fs::path shared = folder_.path() / "shared";
    fs::create_directories(folder_.path() / "elsewhere");
    fs::create_directory(shared);
    fs::create_directory_symlink(folder_.path() / "elsewhere", shared / "out");
    test::OtherUser::give(shared / "out");
    ASSERT_EQ(mkfifo((shared / "pipe").c_str(), 0666), 0);
    test::OtherUser::give(shared / "pipe");
    ASSERT_EQ(chmod(shared.c_str(), 01777), 0);
    EXPECT_THAT(failure_of([&] { write_text(shared / "out/a.txt", "x"); }), HasSubstr("out is a link of user 65534"));
    EXPECT_THAT(failure_of([&] { write_text(shared / "pipe", "x"); }),
                HasSubstr("pipe is a pipe or device of user 65534"));
    EXPECT_TRUE(fs::is_empty(folder_.path() / "elsewhere"));
    ASSERT_EQ(chmod(shared.c_str(), 0755), 0);
    write_text(shared / "out/a.txt", "a link in a folder that is kept by its owner");
    EXPECT_TRUE(fs::exists(folder_.path() / "elsewhere/a.txt"));
}

TEST_F(AtomicFileAmongUsers, LeftoversOfOthersStay) {
    const fs::path leftover = folder_.path() / ".clerestory-0123456789abcdef.part";
    test::write_raw(leftover, "half a picture");
    test::OtherUser::give(leftover);
    EXPECT_EQ(remove_abandoned(folder_.path()), 0U);
    EXPECT_TRUE(fs::exists(leftover));
}

TEST_F(AtomicFileAmongUsers, AGroupIsKept) {
    const fs::path file = folder_.path() / "a.txt";
    write_text(file, "old");
    ASSERT_EQ(chown(file.c_str(), 0, test::OtherUser::ID), 0);
    ASSERT_EQ(chmod(file.c_str(), 0660), 0);
    write_text(file, "new");
    struct stat state {};
    ASSERT_EQ(stat(file.c_str(), &state), 0);
    EXPECT_EQ(state.st_gid, test::OtherUser::ID);
    EXPECT_EQ(mode_of(file), 0660);
}

}  // namespace
}  // namespace clerestory
