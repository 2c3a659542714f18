#include "base/atomic_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <string>

#include "error.hpp"
#include "image.hpp"
#include "image_files.hpp"
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

TEST_F(AtomicFileTest, TheTargetAppearsOnlyAtCommit) {
    const fs::path target = folder_.path() / "a.txt";
    {
        AtomicFile file(target);
        EXPECT_TRUE(fs::exists(file.temporary()));
        EXPECT_EQ(file.temporary().extension(), ".txt");
        EXPECT_FALSE(fs::exists(target));
        test::write_raw(file.temporary(), "whole");
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
    test::write_raw(folder_.path() / ".clerestory-0123456789abcdef.part.exr", "half a picture");
    test::write_raw(folder_.path() / "picture.exr", "a picture");
    const AtomicFile living(folder_.path() / "other.exr");
    EXPECT_EQ(remove_abandoned(folder_.path()), 1U);
    EXPECT_EQ(remove_abandoned(folder_.path() / "missing"), 0U);
    EXPECT_TRUE(fs::exists(living.temporary()));
    EXPECT_EQ(test::names_in(folder_.path()).size(), 2U);
}

}  // namespace
}  // namespace clerestory
