// What reaches the disk, and when: fsync and syncfs of this program are these.
#include "base/durable.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string>
#include <vector>

#include "base/atomic_file.hpp"
#include "error.hpp"
#include "run_program.hpp"

namespace {

/// "fsync NAME" and "syncfs NAME", as they were called while somebody watches.
std::vector<std::string>* watched = nullptr;
int failing_with = 0;

int called(const char* what, int descriptor, int (*real)(int)) {
    if (watched == nullptr) return real(descriptor);
    std::error_code error;
    const auto name = std::filesystem::read_symlink(fmt::format("/proc/self/fd/{}", descriptor), error);
    watched->push_back(fmt::format("{} {}", what, name.filename().string()));
    if (failing_with == 0) return real(descriptor);
    errno = failing_with;
    return -1;
}

}  // namespace

extern "C" int fsync(int descriptor) {
    static const auto real = reinterpret_cast<int (*)(int)>(dlsym(RTLD_NEXT, "fsync"));
    return called("fsync", descriptor, real);
}

extern "C" int syncfs(int descriptor) noexcept {
    static const auto real = reinterpret_cast<int (*)(int)>(dlsym(RTLD_NEXT, "syncfs"));
    return called("syncfs", descriptor, real);
}

namespace clerestory {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class Durable : public testing::Test {
  protected:
    Durable() {
        sync_remembered();  // what other tests have left
        watched = &calls_;
    }
    ~Durable() override {
        watched = nullptr;
        failing_with = 0;
    }
    std::vector<std::string> calls() { return std::exchange(calls_, {}); }
    [[nodiscard]] std::string folder_name() const { return folder_.path().filename().string(); }

    test::TempFolder folder_;
    std::vector<std::string> calls_;
};

TEST_F(Durable, AFewFilesAreSyncedOneByOneWithTheirFolders) {
    write_text(folder_.file("a.txt"), "a");
    write_text(folder_.file("new/deep/b.txt"), "b");
    EXPECT_THAT(calls(), IsEmpty()) << "not before anything is said of them";
    sync_remembered();
    EXPECT_THAT(calls(), testing::UnorderedElementsAre("fsync a.txt", "fsync b.txt", "fsync " + folder_name(),
                                                       "fsync new", "fsync deep"));
    sync_remembered();
    EXPECT_THAT(calls(), IsEmpty()) << "once";
}

TEST_F(Durable, ManyFilesAreSyncedAtOnce) {
    for (int i = 0; i < 100; ++i) write_text(folder_.file(fmt::format("{}.txt", i)), "x");
    sync_remembered();
    EXPECT_THAT(calls(), ElementsAre("syncfs " + folder_name()));
}

TEST_F(Durable, AnOldFileIsReplacedOnlyByOneThatIsOnDisk) {
    write_text(folder_.file("a.txt"), "old");
    sync_remembered();
    calls();
    failing_with = EIO;
    EXPECT_THROW(write_text(folder_.file("a.txt"), "new"), OutputError);
    EXPECT_EQ(test::read_file(folder_.path() / "a.txt"), "old");
    EXPECT_EQ(calls().size(), 1U) << "the new file's bytes";
    failing_with = 0;
    write_text(folder_.file("a.txt"), "new");
    EXPECT_EQ(test::read_file(folder_.path() / "a.txt"), "new");
    EXPECT_EQ(calls().size(), 1U);
    EXPECT_THAT(test::names_in(folder_.path()), ElementsAre("a.txt"));
}

TEST_F(Durable, ADiskThatFailsIsSaid) {
    write_text(folder_.file("a.txt"), "a");
    failing_with = EIO;
    try {
        sync_remembered();
        FAIL() << "nothing was said";
    } catch (const OutputError& error) {
        EXPECT_THAT(error.what(), testing::HasSubstr("a.txt: could not be brought to disk"));
    }
    failing_with = 0;
    sync_remembered();
}

TEST_F(Durable, WhatCannotBeAskedOrHasGoneIsPassedOver) {
    write_text(folder_.file("a.txt"), "a");
    failing_with = EINVAL;
    EXPECT_NO_THROW(sync_remembered());
    failing_with = 0;
    write_text(folder_.file("b.txt"), "b");
    std::filesystem::remove(folder_.file("b.txt"));
    EXPECT_NO_THROW(sync_remembered());
    write_text("/dev/null", "b");
    calls();
    sync_remembered();
    EXPECT_THAT(calls(), IsEmpty());
}

}  // namespace
}  // namespace clerestory
