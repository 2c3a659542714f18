#include "run_program.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clerestory::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(RunProgram, HelpGoesToStdoutAndEndsWithZero) {
    const auto result = run_program({"--help"});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr("Exit codes"));
    EXPECT_THAT(result.err, IsEmpty());
}

TEST(RunProgram, UnknownFlagGoesToStderrAndEndsWithTwo) {
    const auto result = run_program({"devices", "--no-such-flag"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.out, IsEmpty());
    EXPECT_THAT(result.err, HasSubstr("--no-such-flag"));
}

TEST(RunProgram, RunsInTheFolderThatItIsGiven) {
    const TempFolder folder;
    const auto result = run_program({"devices", "--json", "here.json"}, {{}, folder.path()});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(names_in(folder.path()), testing::ElementsAre("here.json"));
}

TEST(RunProgram, TempFolderVanishesWithItsContent) {
    std::filesystem::path path;
    {
        const TempFolder folder;
        path = folder.path();
        std::filesystem::create_directory(path / "inner");
        EXPECT_TRUE(std::filesystem::exists(path / "inner"));
    }
    EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace clerestory::test
