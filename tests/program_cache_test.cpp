#include "cl/program_cache.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "cl/device.hpp"
#include "cl/pocl_bitcode.hpp"
#include "cl/program.hpp"
#include "other_user.hpp"
#include "run_program.hpp"
#include "test_device.hpp"

namespace clerestory::test {
namespace {

const std::vector<unsigned char> BINARY = {0, 1, 2, 255, '\n', 'x'};

TEST(ProgramCache, GivesBackWhatWasStoredForTheSameKeyOnly) {
    const TempFolder folder;
    const ProgramCache cache(folder.path() / "new");
    EXPECT_FALSE(cache.load("key"));
    cache.store("key", BINARY);
    EXPECT_EQ(cache.load("key"), BINARY);
    EXPECT_FALSE(cache.load("other key"));
}

TEST(ProgramCache, DoesNotUseADamagedEntry) {
    const TempFolder folder;
    const ProgramCache cache(folder.path());
    cache.store("key", BINARY);
    const auto entry = folder.path() / names_in(folder.path()).at(0);
    const std::string whole = read_file(entry);
    for (std::size_t length = 0; length < whole.size(); ++length) {
        std::ofstream(entry, std::ios::binary) << whole.substr(0, length);
        EXPECT_FALSE(cache.load("key")) << length;
    }
}

TEST(ProgramCache, KeepsEntriesForTheirOwnerAlone) {
    const TempFolder folder;
    const mode_t before = umask(0);
    ProgramCache(folder.path() / "new").store("key", BINARY);
    umask(before);
    EXPECT_EQ(std::filesystem::status(folder.path() / "new").permissions(), std::filesystem::perms::owner_all);
    const auto entry = folder.path() / "new" / names_in(folder.path() / "new").at(0);
    EXPECT_EQ(std::filesystem::status(entry).permissions(), std::filesystem::perms(0600));
}

/// An attack that worked: the seal is no secret, so anybody can make an entry of his own code.
TEST(ProgramCache, DoesNotUseAnEntryThatOthersCouldHaveMade) {
    const TempFolder folder;
    const ProgramCache cache(folder.path() / "cache");
    cache.store("key", BINARY);
    const auto entry = folder.path() / "cache" / names_in(folder.path() / "cache").at(0);
    std::filesystem::permissions(entry, std::filesystem::perms(0666));
    EXPECT_FALSE(cache.load("key"));
    std::filesystem::permissions(entry, std::filesystem::perms(0600));
    EXPECT_EQ(cache.load("key"), BINARY);
    std::filesystem::permissions(entry.parent_path(), std::filesystem::perms(01777));
    EXPECT_EQ(cache.load("key"), BINARY) << "shared, but nobody can replace it";
    if (OtherUser::is_at_hand()) {
        OtherUser::give(entry);
        EXPECT_FALSE(cache.load("key")) << "whoever owns it";
        cache.store("key", BINARY);  // as root
        EXPECT_EQ(cache.load("key"), BINARY);
    }
    const auto aside = folder.path() / "aside";
    std::filesystem::rename(entry, aside);
    std::filesystem::create_symlink(aside, entry);
    EXPECT_FALSE(cache.load("key")) << "a link";
    std::filesystem::remove(entry);
    ASSERT_EQ(mkfifo(entry.c_str(), 0600), 0);
    EXPECT_FALSE(cache.load("key")) << "a pipe, which nobody waits for";
    std::filesystem::remove(entry);
    std::ofstream(entry) << "clerestory program ";
    std::filesystem::permissions(entry, std::filesystem::perms(0600));
    std::filesystem::resize_file(entry, std::uintmax_t{1} << 40);
    EXPECT_FALSE(cache.load("key")) << "a terabyte";
}

TEST(ProgramCache, IsHarmlessWhereItsFolderCannotBe) {
    const TempFolder folder;
    std::ofstream(folder.file("file")) << "in the way";
    const ProgramCache blocked(folder.path() / "file" / "below");
    blocked.store("key", BINARY);
    EXPECT_FALSE(blocked.load("key"));
    const ProgramCache none({});
    none.store("key", BINARY);
    EXPECT_FALSE(none.load("key"));
}

TEST(ProgramCache, AProgramBuildsFromSourceThenFromTheCacheThenAroundADamagedOne) {
    const TempFolder folder;
    const TestDevice device({.selector = "", .threads = 0, .work_group = 0, .program_cache = folder.path()});
    const auto kernels_of = [&] { return Program(device, "display.cl").handle().getInfo<CL_PROGRAM_NUM_KERNELS>(); };
    const auto from_source = kernels_of();
    ASSERT_EQ(names_in(folder.path()).size(), 1U);
    EXPECT_EQ(kernels_of(), from_source);
    std::ofstream(folder.path() / names_in(folder.path()).at(0)) << "damaged";
    EXPECT_EQ(kernels_of(), from_source);
}

/// A binary as PoCL lays it out: what goes before, the name of a file, its length, its bytes, what comes after.
std::vector<unsigned char> pocl_binary(const std::string& name, unsigned char length, const std::string& content) {
    std::string bytes = std::string("poclbin\0 a head", 16) + name;
    bytes.append({static_cast<char>(length), 0, 0, 0});
    bytes += content;
    return {bytes.begin(), bytes.end()};
}

const std::string BITCODE = "BC\xC0\xDE bits";

TEST(PoclBitcode, IsFoundWithinABinary) {
    const auto found = bitcode_in(pocl_binary("/program.bc", 9, BITCODE + "more"));
    ASSERT_TRUE(found);
    EXPECT_EQ(std::string(found->begin(), found->end()), BITCODE);
}

TEST(PoclBitcode, IsNotFoundInABinaryCutShortOrOfAnotherKind) {
    const auto whole = pocl_binary("/program.bc", 9, BITCODE);
    ASSERT_TRUE(bitcode_in(whole));
    for (std::size_t length = 0; length < whole.size(); ++length) {
        EXPECT_FALSE(bitcode_in({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)})) << length;
    }
    EXPECT_FALSE(bitcode_in(pocl_binary("/program.so", 9, BITCODE)));
    EXPECT_FALSE(bitcode_in(pocl_binary("/program.bc", 9, "\177ELF bits")));
    EXPECT_FALSE(bitcode_in(pocl_binary("/program.bc", 3, BITCODE)));
    EXPECT_FALSE(bitcode_in(pocl_binary("/program.bc", 10, BITCODE)));
}

TEST(PoclBitcode, IsWhatTheCacheKeepsOnPocl) {
    const TempFolder folder;
    const TestDevice device({.selector = "", .threads = 0, .work_group = 0, .program_cache = folder.path()});
    if (!is_pocl(device.info())) GTEST_SKIP() << "not PoCL";
    const Program program(device, "display.cl");
    const std::string entry = read_file(folder.path() / names_in(folder.path()).at(0));
    EXPECT_EQ(entry.find("BC\xC0\xDE"), entry.find('\n') + 1);
    EXPECT_EQ(entry.find("poclbin"), std::string::npos);
}

}  // namespace
}  // namespace clerestory::test
