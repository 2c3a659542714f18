// The program beside streams that are closed, full or read by nobody: messages are not worth the work.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "base/text_escape.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;

class StandardStreams : public testing::Test {
  protected:
    /// Runs the program with redirections, as a shell's user would; the status that it ended with.
    int run(const std::string& arguments, const std::string& redirections) {
        const std::string line = fmt::format("cd {} && {} {} {}", shell_word(folder_.path().string()),
                                             shell_word(CLERESTORY_PROGRAM), arguments, redirections);
        return run_command({"bash", "-c", line}).exit_code;
    }
    /// The same where the reader of a stream has gone before the program starts.
    int run_unread(const std::string& arguments, const std::string& redirections) {
        const std::string line = fmt::format(
            "cd {} && {{ sleep 0.2; {} {} {}; echo $? >status; }} 4>&1 | :", shell_word(folder_.path().string()),
            shell_word(CLERESTORY_PROGRAM), arguments, redirections);
        run_command({"bash", "-c", line});
        return std::stoi(read_file(folder_.path() / "status"));
    }
    void write_jobs() const {
        std::ofstream(folder_.file("broken.exr")) << "no picture";
        std::ofstream(folder_.file("jobs.toml"))
            << "[defaults]\nmap = \"x.exr\"\nsize = 9\nsamples = 8\n[[job]]\noutput = \"a.exr\"\n"
               "[[job]]\nmap = \"broken.exr\"\noutput = \"b.exr\"\n[[job]]\nseed = 2\noutput = \"c.exr\"\n";
    }

    TempFolder folder_;
    const std::string render_ = "render -n 8 --size 9 -o x.exr";
};

TEST_F(StandardStreams, AnErrorHasItsCodeThoughNobodyCanBeTold) {
    for (const char* redirection : {"2>&-", "2>/dev/full", "<&- >&- 2>&-"}) {
        EXPECT_EQ(run("render nosuch.exr -o x.exr", redirection), 3) << redirection;
        EXPECT_EQ(run("render --nosuch", redirection), 2) << redirection;
    }
    EXPECT_EQ(run_unread("render nosuch.exr -o x.exr", "2>&4 >/dev/null"), 3);
}

TEST_F(StandardStreams, WorkGoesOnWithoutMessages) {
    ASSERT_EQ(run(render_, ""), 0);
    const std::string expected = read_file(folder_.path() / "x.exr");
    for (const char* redirection : {"2>&-", "2>/dev/full", "<&-", ">&-", "<&- >&- 2>&-"}) {
        fs::remove(folder_.path() / "x.exr");
        EXPECT_EQ(run(render_, redirection), 0) << redirection;
        // Headers hold times: the pixels come last.
        const std::string picture = read_file(folder_.path() / "x.exr");
        constexpr std::size_t PIXELS =
            std::size_t{9} * (4 * 4 * 9 + 8);  // nine rows of nine RGBA floats, each behind its number and length
        ASSERT_GT(picture.size(), PIXELS);
        EXPECT_EQ(picture.substr(picture.size() - PIXELS), expected.substr(expected.size() - PIXELS)) << redirection;
    }
    fs::remove(folder_.path() / "x.exr");
    EXPECT_EQ(run_unread(render_, "2>&4 >/dev/null"), 0);
    EXPECT_TRUE(fs::exists(folder_.path() / "x.exr"));
}

TEST_F(StandardStreams, ABatchWritesAllItsPicturesAndItsReport) {
    ASSERT_EQ(run(render_, ""), 0);
    write_jobs();
    const auto expect_all = [&](int exit_code, const std::string& redirections) {
        EXPECT_EQ(exit_code, 1) << redirections << ": one job has a broken map";
        for (const char* file : {"a.exr", "c.exr", "batch.json"}) {
            EXPECT_TRUE(fs::remove(folder_.path() / file)) << file << " " << redirections;
        }
    };
    for (const char* redirection : {"2>&-", "2>/dev/full"})
        expect_all(run("batch -v jobs.toml", redirection), redirection);
    expect_all(run_unread("batch -v jobs.toml", "2>&4 >/dev/null"), "a pipe that nobody reads");
}

TEST_F(StandardStreams, WhatWasToGoToStdoutIsMissedAndAPipeEndsTheProgramAsAnyOther) {
    for (const char* redirection : {">&-", ">/dev/full"}) {
        EXPECT_EQ(run("info --json - 2>/dev/null", redirection), 5) << redirection;
        EXPECT_EQ(run("info 2>/dev/null", redirection), 5) << redirection;
    }
    constexpr int SIGPIPE_STATUS = 128 + 13;
    EXPECT_EQ(run_unread("info --json -", ">&4 2>/dev/null"), SIGPIPE_STATUS);
}

/// PoCL 3.1 leaves this program enough of six, PoCL 6.0 needs a few more.
TEST_F(StandardStreams, SixteenDescriptorsAreEnough) {
    ASSERT_EQ(run(render_, ""), 0);  // kernels are compiled by then
    fs::remove(folder_.path() / "x.exr");
    const std::string line = fmt::format("cd {} && ulimit -n 16 && {} {}", shell_word(folder_.path().string()),
                                         shell_word(CLERESTORY_PROGRAM), render_);
    EXPECT_EQ(run_command({"bash", "-c", line}).exit_code, 0);
    EXPECT_TRUE(fs::exists(folder_.path() / "x.exr"));
}

TEST_F(StandardStreams, NeitherProcNorANetworkIsNeeded) {
    if (run_command({"unshare", "-mn", "umount", "-l", "/proc"}).exit_code != 0) {
        GTEST_SKIP() << "takes root, and a system that lets it hide /proc from itself";
    }
    const std::string line = fmt::format("umount -l /proc; cd {} && {} {}", shell_word(folder_.path().string()),
                                         shell_word(CLERESTORY_PROGRAM), render_);
    const ProgramResult result = run_command({"unshare", "-mn", "bash", "-c", line});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(fs::exists(folder_.path() / "x.exr"));
}

TEST_F(StandardStreams, StdoutsOwnFileIsWrittenToNotReplaced) {
    EXPECT_EQ(run("info --json /dev/stdout 2>/dev/null", ">>both"), 0);
    const std::string both = read_file(folder_.path() / "both");
    EXPECT_THAT(both, testing::StartsWith("map  "));
    EXPECT_THAT(both, testing::HasSubstr("\n{\n"));
    EXPECT_THAT(both, testing::EndsWith("}\n"));
}

}  // namespace
}  // namespace clerestory::test
