// What is typed: numbers, names and words that nearly fit; and where answers go when stdout cannot take them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/atomic_file.hpp"
#include "image.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class CommandLine : public ::testing::Test {
  protected:
    CommandLine() {
        const std::vector<float> rgba(8 * 4 * 4, 1);
        write_exr(map_, 8, 4, rgba.data(), {});
    }

    /// Exit 2 before any work: one line that holds `words`.
    void expect_usage(const std::vector<std::string>& arguments, const std::string& words) {
        const auto before = names_in(folder_.path());
        const ProgramResult result = run_program(arguments, {.folder = folder_.path()});
        EXPECT_EQ(result.exit_code, 2) << result.err;
        EXPECT_THAT(result.err, HasSubstr(words));
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        EXPECT_EQ(names_in(folder_.path()), before);
    }

    TempFolder folder_;
    std::string map_ = folder_.file("m.exr");
};

TEST_F(CommandLine, WordsThatNearlyFitAreAskedAbout) {
    expect_usage({"rendr"}, "no command is named rendr; did you mean render?");
    expect_usage({"zzz"}, "no command is named zzz");
    expect_usage({}, "a command is required: info, sample, render");
    expect_usage({"--no-such"}, "no flag is named --no-such");
    expect_usage({"render", "m.exr", "--exposre", "2"}, "render has no flag --exposre; did you mean --exposure?");
    expect_usage({"render", "m.exr", "--exposre=2"}, "did you mean --exposure?");
    expect_usage({"render", "m.exr", "--estimator", "exct"}, "did you mean exact?");
    expect_usage({"sample", "m.exr", "--sequence", "soboll"}, "did you mean sobol?");
    expect_usage({"render", "m.exr", "--export", "pbr", "-o", "x.exr"}, "did you mean pbrt?");
}

TEST_F(CommandLine, NumbersAreDecimalWhateverZerosLeadThem) {
    const ProgramResult result = run_program(
        {"render", "m.exr", "-n", "0100", "--size", "0063", "--seed", "0008", "--control-degree", "00", "--json", "-"},
        {.folder = folder_.path()});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json report = json::parse(result.out);
    EXPECT_EQ(report["samples"], 100);
    EXPECT_EQ(report["size"], 63);
    EXPECT_EQ(report["seed"], 8);
    EXPECT_EQ(report["control_degree"], 0);
    EXPECT_EQ(run_program({"render", map_, "-n", "010,0x", "--json", "-"}).exit_code, 2);
}

TEST_F(CommandLine, NumbersThatAreNoneOrOutOfRangeAreRefusedWithWhatIsWrong) {
    for (const std::string wrong : {"10k", "0x10", "1e3", "-1", "0", "1073741825", "", " 4", "4.0"}) {
        expect_usage({"render", "m.exr", "-o", "x.exr", "-n", wrong},
                     "--samples: " + wrong + " is not a whole number from 1 to 1073741824");
    }
    for (const std::string wrong : {"-1", "18446744073709551616"}) {
        expect_usage({"render", "m.exr", "-o", "x.exr", "--seed", wrong},
                     "--seed: " + wrong + " is not a whole number from 0 to 18446744073709551615");
    }
    const ProgramResult last =
        run_program({"render", map_, "-n", "4", "--size", "5", "--seed", "18446744073709551615", "--json", "-"});
    ASSERT_EQ(last.exit_code, 0) << last.err;
    EXPECT_EQ(json::parse(last.out)["seed"], 18446744073709551615U);
}

TEST_F(CommandLine, EmptyNamesAndForgottenOnesAreRefused) {
    for (const char* command : {"render", "info", "sample", "sheet", "study", "reproduce"}) {
        expect_usage({command, ""}, "MAP: the name is empty");
    }
    expect_usage({"render", "m.exr", "-o", ""}, "the name is empty");
    expect_usage({"info", "--json", "-o", "x.png"}, "-o looks like a flag");
    expect_usage({"render", "m.exr", "-o", "--json"}, "--output");
}

TEST_F(CommandLine, TheBundledMapIsNamedWhereItIsTaken) {
    const std::vector<std::string> render = {"render", "-n", "4", "--size", "5", "--json", "-"};
    EXPECT_THAT(run_program(render).err, HasSubstr("no map named: the bundled city"));
    std::vector<std::string> quiet = render;
    quiet.emplace_back("-q");
    EXPECT_EQ(run_program(quiet).err, "");
    EXPECT_THAT(run_program({"render", map_, "-n", "4", "--size", "5", "--json", "-"}).err, Not(HasSubstr("bundled")));
}

TEST_F(CommandLine, SuffixesMayBeOfAnyCase) {
    const ProgramResult result = run_program(
        {"render", "m.exr", "-n", "4", "--size", "5", "-o", "a.EXR", "-o", "b.Png"}, {.folder = folder_.path()});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(read_picture(folder_.path() / "a.EXR").width, 5U);
    EXPECT_EQ(read_file(folder_.path() / "b.Png").substr(1, 3), "PNG");
    EXPECT_EQ(run_program({"fresnel", "-o", "c.CSV", "-o", "d.SVG"}, {.folder = folder_.path()}).exit_code, 0);
    EXPECT_EQ(run_program({"sheet", "m.exr", "-n", "4", "--panel", "128", "-o", "e.PNG"}, {.folder = folder_.path()})
                  .exit_code,
              0);
}

TEST_F(CommandLine, AStdoutThatTakesNothingIsExitFive) {
    if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
    for (const std::string arguments : {"info m.exr", "info m.exr --json -", "compare m.exr m.exr", "fresnel", "--help",
                                        "render --help", "--version", "devices", "fresnel --json -"}) {
        const ProgramResult result = run_command(
            {"sh", "-c", "exec \"$0\" " + arguments + " > /dev/full", CLERESTORY_PROGRAM}, {.folder = folder_.path()});
        EXPECT_EQ(result.exit_code, 5) << arguments << ": " << result.err;
        EXPECT_THAT(result.err, HasSubstr("stdout")) << arguments;
    }
}

TEST_F(CommandLine, NamesThatAreNoUtf8AreReported) {
    const std::string name = "caf\xE9.exr";
    std::filesystem::copy_file(map_, folder_.path() / name);
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"render", name, "-n", "4", "--size", "5", "-o", "lit_" + name, "--json", "r.json"},
          {"info", name, "--json", "r.json"},
          {"sample", name, "-n", "4", "--lights", "json,exr", "-o", ".", "--json", "r.json"},
          {"sheet", name, "-n", "4", "--panel", "128", "-o", "s.png", "--json", "r.json"}}) {
        const ProgramResult result = run_program(arguments, {.folder = folder_.path()});
        EXPECT_EQ(result.exit_code, 0) << arguments[0] << ": " << result.err;
        EXPECT_THAT(read_file(folder_.path() / "r.json"), HasSubstr("caf\xEF\xBF\xBD.exr")) << arguments[0];
    }
}

TEST_F(CommandLine, ANameThatIsNoUtf8DoesNotStopABatch) {
    std::filesystem::create_directory(folder_.path() / "maps");
    std::filesystem::copy_file(map_, folder_.path() / "maps" / "caf\xE9.exr");
    std::filesystem::copy_file(map_, folder_.path() / "maps" / "plain.exr");
    write_text(folder_.path() / "jobs.toml",
               "[[job]]\nmap = \"maps/*.exr\"\nsize = 5\nsamples = 4\noutput = \"out/{map}.exr\"\n");
    const ProgramResult first = run_program({"batch", "jobs.toml"}, {.folder = folder_.path()});
    EXPECT_EQ(first.exit_code, 0) << first.err;
    EXPECT_TRUE(std::filesystem::exists(folder_.path() / "out" / "plain.exr"));
    EXPECT_TRUE(std::filesystem::exists(folder_.path() / "out" / "caf\xE9.exr"));
    EXPECT_THAT(run_program({"batch", "jobs.toml", "--resume"}, {.folder = folder_.path()}).err,
                HasSubstr("2 skipped"));
}

}  // namespace
}  // namespace clerestory::test
