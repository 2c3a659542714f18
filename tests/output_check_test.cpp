// No output replaces an input or another output, whatever path, link or command names it.
#include "base/output_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "error.hpp"
#include "image.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class OutputCheck : public ::testing::Test {
  protected:
    OutputCheck() {
        const std::vector<float> rgba(8 * 4 * 4, 1);
        for (const auto& file : {map_, folder_.file("second.exr")}) write_exr(file, 8, 4, rgba.data(), {});
        fs::create_symlink("m.exr", folder_.path() / "soft.exr");
        fs::create_hard_link(map_, folder_.path() / "hard.exr");
        fs::create_directory_symlink(".", folder_.path() / "here");
    }

    /// Exit 2, one line that holds `words`, and every file as it was.
    void expect_refused(const std::vector<std::string>& arguments, const std::string& words) {
        const auto names = names_in(folder_.path());
        const std::string before = read_file(map_);
        const ProgramResult result = run_program(arguments, {.folder = folder_.path()});
        EXPECT_EQ(result.exit_code, 2) << result.err;
        EXPECT_THAT(result.err, HasSubstr(words));
        EXPECT_EQ(names_in(folder_.path()), names);
        EXPECT_EQ(read_file(map_), before);
    }

    TempFolder folder_;
    std::string map_ = folder_.file("m.exr");
};

TEST_F(OutputCheck, AFileIsTheSameByEveryPath) {
    const auto identity = file_identity(map_);
    ASSERT_TRUE(identity);
    for (const char* path : {"soft.exr", "hard.exr", "here/m.exr", "./m.exr", "here/here/soft.exr"}) {
        EXPECT_EQ(file_identity(folder_.path() / path), identity) << path;
    }
    EXPECT_NE(file_identity(folder_.path() / "second.exr"), identity);
}

TEST_F(OutputCheck, AFileThatIsNotThereYetIsTheSameByEveryPath) {
    const auto identity = file_identity(folder_.path() / "new/deep.exr");
    ASSERT_TRUE(identity);
    EXPECT_EQ(file_identity(folder_.path() / "here/new/./deep.exr"), identity);
    EXPECT_NE(file_identity(folder_.path() / "new/other.exr"), identity);
}

TEST_F(OutputCheck, ADeviceReplacesNothing) {
    EXPECT_FALSE(file_identity("/dev/null"));
    EXPECT_FALSE(file_identity(""));
    const std::vector<fs::path> twice = {"/dev/null", "/dev/null", "-", "-", ""};
    EXPECT_NO_THROW(check_outputs({}, twice));
}

TEST_F(OutputCheck, InputsAreNamedInTheMessage) {
    const std::vector<fs::path> inputs = {map_};
    const std::vector<fs::path> outputs = {folder_.path() / "hard.exr"};
    try {
        check_outputs(inputs, outputs);
        FAIL() << "not refused";
    } catch (const UsageError& error) {
        EXPECT_THAT(error.what(), HasSubstr("hard.exr would replace " + map_ + ", which is read"));
    }
}

TEST_F(OutputCheck, AMapAfterAnOutputIsTheMapAndNoSecondOutput) {
    const std::string before = read_file(map_);
    const ProgramResult result = run_program(
        {"render", "--size", "5", "-n", "4", "-o", "x.exr", "m.exr", "--json", "-"}, {.folder = folder_.path()});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("\"file\": \"m.exr\""));
    EXPECT_TRUE(fs::exists(folder_.path() / "x.exr"));
    EXPECT_EQ(read_file(map_), before);
}

TEST_F(OutputCheck, NoFlagTakesTheMapForASecondValue) {
    const std::vector<std::vector<std::string>> flags = {
        {"render", "--size", "5", "-o", "x.png", "-n", "4"},
        {"render", "--size", "5", "-o", "x.png", "--export", "pbrt"},
        {"sample", "-o", ".", "-n", "4"},
        {"sample", "-n", "4", "--lights", "json"},
        {"info", "--table-arithmetic", "f32"},
        {"sheet", "--panel", "128", "-n", "4"},
        {"reproduce", "--size", "16", "-o", ".", "--only", "figure_07"}};
    for (std::vector<std::string> arguments : flags) {
        arguments.insert(arguments.end(), {"m.exr", "--json", "-", "-q"});
        const ProgramResult result = run_program(arguments, {.folder = folder_.path()});
        EXPECT_EQ(result.exit_code, 0) << arguments[0] << result.err;
        EXPECT_THAT(result.out, HasSubstr("\"file\": \"m.exr\"")) << arguments[0];
    }
}

TEST_F(OutputCheck, EveryCommandRefusesToReplaceItsMap) {
    for (const std::string name : {"m.exr", "soft.exr", "hard.exr", "here/m.exr"}) {
        const std::string words = name + " would replace m.exr";
        expect_refused({"render", "m.exr", "-o", "x.exr", "-o", name}, words);
        for (const char* command : {"render", "info", "sample", "sheet", "study", "reproduce"}) {
            expect_refused({command, "m.exr", "--json", name}, words);
        }
        expect_refused({"compare", "m.exr", "second.exr", "--json", name}, words);
        expect_refused({"merge", "m.exr", "--json", name}, words);
    }
    expect_refused({"compare", "second.exr", "m.exr", "--json", "soft.exr"}, "would replace m.exr");
}

TEST_F(OutputCheck, NamesThatCommandsMakeUpReplaceNoMap) {
    const auto refused = [&](const std::string& made_up, std::vector<std::string> arguments) {
        fs::copy_file(map_, folder_.path() / made_up);
        arguments.insert(arguments.begin() + 1, made_up);
        expect_refused(arguments, "would replace " + made_up);
        fs::remove(folder_.path() / made_up);
    };
    refused("samples_64.png", {"sample", "-n", "64", "-o", "."});
    refused("samples_64.csv", {"sample", "-n", "64", "-o", "here"});
    refused("lights_64.exr", {"sample", "-n", "64", "--lights", "exr", "-o", "."});
    refused("sheet.png", {"sheet"});
    refused("error_time.svg", {"study", "-o", "."});
    refused("figure_07.png", {"reproduce", "-o", "."});
    refused("x.pbrt", {"render", "--export", "pbrt", "-o", "x.exr"});
    refused("x_8.exr", {"render", "-n", "4,8", "-o", "x.exr"});
}

TEST_F(OutputCheck, TwoOutputsNeedTwoNames) {
    expect_refused({"render", "m.exr", "-o", "x.exr", "-o", "here/x.exr"},
                   "two results would be written to here/x.exr");
    expect_refused({"render", "m.exr", "-o", "x.exr", "--json", "./x.exr"}, "two results would be written to");
    expect_refused({"fresnel", "-o", "x.csv", "-o", "./x.csv"}, "two results would be written to");
    expect_refused({"fresnel", "-o", "x.json", "--json", "x.json"}, "two results would be written to x.json");
    expect_refused({"sample", "m.exr", "-n", "64,64"}, "two results would be written to");
    expect_refused({"study", "m.exr", "-o", ".", "--json", "study.json"}, "two results would be written to");
    expect_refused({"reproduce", "m.exr", "-o", ".", "--json", "report.json"}, "two results would be written to");
}

TEST_F(OutputCheck, RenderWithNothingToWriteSaysSo) {
    expect_refused({"render", "m.exr"}, "nothing to write");
    EXPECT_EQ(run_program({"render", map_, "--size", "5", "-n", "4", "--json", "-"}).exit_code, 0);
}

TEST_F(OutputCheck, ABatchReplacesNeitherMapsNorItsOwnFiles) {
    const auto run = [&](const std::string& output, const std::vector<std::string>& more = {}) {
        std::ofstream(folder_.path() / "jobs.exr")
            << "[[job]]\nmap = \"m.exr\"\nsize = 5\nsamples = 4\noutput = \"" << output << "\"\n";
        std::vector<std::string> arguments = {"batch", "jobs.exr"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const std::string before = read_file(map_);
        const std::string jobs = read_file(folder_.path() / "jobs.exr");
        ProgramResult result = run_program(arguments, {.folder = folder_.path()});
        EXPECT_EQ(read_file(map_), before);
        EXPECT_EQ(read_file(folder_.path() / "jobs.exr"), jobs);
        return result;
    };
    for (const char* name : {"m.exr", "soft.exr", "hard.exr", "here/m.exr"}) {
        const ProgramResult result = run(name);
        EXPECT_EQ(result.exit_code, 3) << name;
        EXPECT_THAT(result.err, HasSubstr("would be replaced by a picture, and it is a map of this batch"));
    }
    EXPECT_THAT(run("here/jobs.exr").err, HasSubstr("it is the job file"));
    EXPECT_THAT(run("x.exr", {"--json", "x.exr"}).err, HasSubstr("it is a report of this batch"));
    EXPECT_EQ(run("x.exr", {"--json", "soft.exr"}).exit_code, 2);
    EXPECT_EQ(run("x.exr", {"--json", "jobs.exr"}).exit_code, 2);
    EXPECT_EQ(run("x.exr", {"--json", "batch.json"}).exit_code, 2);
    fs::create_symlink("m.exr", folder_.path() / "batch.json");
    EXPECT_EQ(run("x.exr").exit_code, 2);
}

TEST_F(OutputCheck, FolderOfAJobFileNamedWithoutOneIsTheRealOne) {
    fs::create_directory(folder_.path() / "studio");
    fs::copy_file(map_, folder_.path() / "studio/m.exr");
    std::ofstream(folder_.path() / "studio/jobs.toml")
        << "[[job]]\nmap = \"m.exr\"\nsize = 5\nsamples = 4\noutput = \"{folder}/{map}_lit.exr\"\n";
    const ProgramResult result = run_program({"batch", "jobs.toml"}, {.folder = folder_.path() / "studio"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(fs::exists(folder_.path() / "studio/studio/m_lit.exr"));
}

}  // namespace
}  // namespace clerestory::test
