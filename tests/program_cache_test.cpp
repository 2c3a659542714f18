#include "cl/program_cache.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "cl/device.hpp"
#include "cl/program.hpp"
#include "run_program.hpp"

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
    const Device device({.selector = "", .threads = 0, .work_group = 0, .program_cache = folder.path()});
    const auto kernels_of = [&] { return Program(device, "display.cl").handle().getInfo<CL_PROGRAM_NUM_KERNELS>(); };
    const auto from_source = kernels_of();
    ASSERT_EQ(names_in(folder.path()).size(), 1U);
    EXPECT_EQ(kernels_of(), from_source);
    std::ofstream(folder.path() / names_in(folder.path()).at(0)) << "damaged";
    EXPECT_EQ(kernels_of(), from_source);
}

}  // namespace
}  // namespace clerestory::test
