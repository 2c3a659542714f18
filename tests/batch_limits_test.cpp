// Job files and reports that ask for more than there is: each is refused with its number, at once and in little memory.
#include <fcntl.h>
#include <fmt/format.h>
#include <glob.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "base/clock.hpp"
#include "batch/batch_limits.hpp"
#include "batch/job_file.hpp"
#include "batch/job_text.hpp"
#include "batch/map_glob.hpp"
#include "batch/plan.hpp"
#include "batch/words.hpp"
#include "error.hpp"
#include "image_files.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

using namespace batch_limits;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::string repeated(std::size_t count, const std::string& text) {
    std::string all;
    all.reserve(count * text.size());
    for (std::size_t i = 0; i < count; ++i) all += text;
    return all;
}

std::string numbered(std::size_t count, const std::function<std::string(std::size_t)>& line) {
    std::string all;
    for (std::size_t i = 0; i < count; ++i) all += line(i);
    return all;
}

const std::string JOB = "[[job]]\nmap = \"a.pfm\"\noutput = \"{rotation}_{samples}_{seed}.png\"\n";

class BatchLimits : public ::testing::Test {
  protected:
    BatchLimits() { write_pfm(folder_.path() / "a.pfm", 2, 1, {1, 1, 1, 1, 1, 1}); }

    /// What the program says of input that it must refuse; file names without their folder.
    std::string refusal(const std::vector<std::string>& words) {
        // Ten times what it takes, for a busy machine and sanitizers.
        constexpr double MOST_SECONDS = 20;
        constexpr long MOST_KIB = 400 << 10;
        const Stopwatch watch;
        const ProgramResult result = run_program(words);
        EXPECT_EQ(result.exit_code, 3) << result.err.substr(0, 500);
        EXPECT_LT(watch.seconds(), MOST_SECONDS);
        EXPECT_LT(result.peak_kib, MOST_KIB);
        EXPECT_LT(result.err.size(), 20000U);
        std::string said = result.err;
        const std::string folder = folder_.path().string() + "/";
        for (auto at = said.find(folder); at != std::string::npos; at = said.find(folder))
            said.erase(at, folder.size());
        return said;
    }
    std::string refusal_of_jobs(const std::string& text) {
        write_raw(folder_.path() / "jobs.toml", text);
        return refusal({"batch", folder_.file("jobs.toml"), "--dry-run"});
    }
    std::string refusal_of_report(const std::string& text) {
        write_raw(folder_.path() / "batch.json", text);
        return refusal({"merge", folder_.file("batch.json")});
    }

    TempFolder folder_;
};

TEST_F(BatchLimits, DepthIsRefusedBeforeTheParserRecurses) {
    const std::string dots = "a" + repeated(40000, ".a");
    EXPECT_THAT(refusal_of_jobs("x = 1\n" + dots + " = 1\n"),
                HasSubstr("jobs.toml:2:32: 40001 parts make one key; 16 are the most"));
    EXPECT_THAT(refusal_of_jobs("[" + dots + "]\n"), HasSubstr("jobs.toml:1:33: 40001 parts"));
    EXPECT_THAT(refusal_of_jobs("[[job]]\nmap = [{" + dots + " = 1}]\n"), HasSubstr("jobs.toml:2:40: 40001 parts"));
    EXPECT_THAT(refusal_of_jobs("\"\u00e9\" = " + repeated(40000, "[")),
                HasSubstr("jobs.toml:1:23: 40000 brackets and braces stand within one another; 16 are the most"));
    EXPECT_THAT(refusal_of_jobs("a = " + repeated(40000, "{a = ")), HasSubstr("40000 brackets and braces"));
}

TEST_F(BatchLimits, WhatStandsInStringsAndCommentsIsNoDepth) {
    const std::string deep = repeated(40, "[.{");
    for (const std::string& text :
         {"# " + deep + "\n", "a = \"" + deep + "\\\"" + deep + "\"\n", "a = '" + deep + "\\'\n",
          "a = \"\"\"\n" + deep + "\n\\\"\"\"" + deep + "\"\"\"\"\"\n", "a = '''\n" + deep + "\n''" + deep + "'''''\n",
          "\"" + deep + "\" = 1\n", "a = ''\nb = \"\"\nc = \"\\\\\"\nd = [0.5, 1.5] # " + deep,
          repeated(1000, "a.b = [[0.5], {c = 1.5}]\n")}) {
        EXPECT_NO_THROW(check_job_text("jobs.toml", text)) << text.substr(0, 200);
        EXPECT_THROW(check_job_text("jobs.toml", text + "\na = " + deep), InputError) << text.substr(0, 200);
    }
}

TEST_F(BatchLimits, LongFilesAreRefusedWhereverTheyComeFrom) {
    EXPECT_THAT(refusal_of_jobs(std::string(MOST_JOB_FILE_BYTES + 5, '\n')),
                HasSubstr("jobs.toml:1:1: has 2097157 bytes; 2097152 are the most of a job file"));
    EXPECT_THAT(refusal({"batch", "/dev/zero", "--dry-run"}),
                HasSubstr("/dev/zero:1:1: has more than 2097152 bytes; 2097152 are the most of a job file"));
    EXPECT_THAT(refusal({"merge", "/dev/zero"}), HasSubstr("/dev/zero: is no report"));
    EXPECT_THAT(refusal_of_jobs(repeated(MOST_TABLES + 1, "[[job]]\n")),
                HasSubstr("jobs.toml:20001:1: 20001 tables are named by headers and dotted keys; 20000 are the most"));
}

TEST_F(BatchLimits, AJobFileMayBeAPipe) {
    const std::string pipe = folder_.file("pipe");
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    std::thread writer([&] { write_raw(pipe, JOB); });
    const ProgramResult result = run_program({"batch", pipe, "--dry-run"});
    writer.join();
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("1 jobs"));
}

TEST_F(BatchLimits, OfManyMistakesTheFirstAreTold) {
    const std::string unknown = numbered(150000, [](std::size_t i) { return fmt::format("k{} = 1\n", i); });
    const std::string said = refusal_of_jobs("[[job]]\n" + unknown);
    EXPECT_THAT(said, HasSubstr("jobs.toml:2:1: unknown key \"k0\""));
    EXPECT_THAT(said, HasSubstr("jobs.toml: and more of the kind"));
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1 + static_cast<long>(MOST_MISTAKES));
    EXPECT_THAT(refusal_of_jobs(unknown), HasSubstr("jobs.toml:1:1: unknown key \"k0\""));
    EXPECT_THAT(refusal_of_jobs(JOB + "samples = [" + repeated(400000, "'x',") + "]\n"),
                HasSubstr("jobs.toml:4:12: samples: \"x\" is given"));
}

TEST_F(BatchLimits, LongWordsAreCutShort) {
    const std::string word(1000000, 'x');
    const std::string cut = "\"" + std::string(100, 'x') + "...\" (1000000 bytes)";
    EXPECT_THAT(refusal_of_jobs(JOB + word + " = 1\n"), HasSubstr("jobs.toml:4:1: unknown key " + cut));
    EXPECT_THAT(refusal_of_jobs(JOB + "estimator = '" + word + "'\n"), HasSubstr("estimator: " + cut + " is given"));
    EXPECT_THAT(refusal_of_jobs("[[job]]\nmap = '" + word + "'\noutput = '" + word + ".png'\n"),
                HasSubstr("jobs.toml:2:7: map: " + cut + " is given; it takes at most 4095 bytes"));
    EXPECT_THAT(refusal_of_jobs(JOB + "layer = '" + word + "'\n"), HasSubstr("it takes at most 255 bytes"));
    EXPECT_EQ(shortened(repeated(60, "\u00e9"), 99), repeated(49, "\u00e9") + "... (120 bytes)");
}

TEST_F(BatchLimits, PicturesAreCountedBeforeTheyAreMade) {
    const std::string sixteen = "samples = [1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16]\n";
    const std::string most = "; 200000 are the most of one batch";
    EXPECT_THAT(refusal_of_jobs(JOB + sixteen + "rotate_y = {from = 0, to = 999999}\n"),
                HasSubstr("jobs.toml:5:12: rotate_y: gives 1000000 rotations" + most));
    EXPECT_THAT(refusal_of_jobs(JOB + sixteen + "rotate_y = {from = 0, to = 99999}\n"),
                HasSubstr("jobs.toml:1:1: gives 1600000 pictures" + most + "; split the file"));
    EXPECT_THAT(refusal_of_jobs(JOB + "rotate_y = [" + repeated(2000, "{from = 0, to = 199999},") + "]\n"),
                HasSubstr("rotate_y: gives 400000 rotations with those before it" + most));
    // Lists of defaults, which every job has; also of jobs that are wrong and so give no picture.
    const std::string defaults = "[defaults]\nmap = \"a.pfm\"\noutput = \"x.png\"\nrotate_y = {from = 0, to = 999}\n";
    EXPECT_THAT(refusal_of_jobs(defaults + repeated(10000, "[[job]]\n")),
                HasSubstr("jobs.toml:205:1: the jobs up to this one give 201000 pictures" + most));
    EXPECT_THAT(refusal_of_jobs(repeated(10000, "[[job]]\nsamples = []\nrotate_y = {from = 0, to = 199999}\n")),
                HasSubstr("jobs.toml:4:1: the jobs up to this one give 400000 pictures"));
    EXPECT_THAT(refusal_of_jobs(JOB + "seed = [" + repeated(3000, "1,") + "]\nsamples = [" + repeated(3000, "1,") +
                                "]\nrotate_y = [" + repeated(3000, "1,") + "]\n"),
                HasSubstr("gives 27000000000 pictures"));
    // Times the files that a pattern finds.
    for (const char* name : {"b.pfm", "c.pfm"}) std::filesystem::copy_file(folder_.file("a.pfm"), folder_.file(name));
    EXPECT_THAT(refusal_of_jobs("[[job]]\nmap = \"?.pfm\"\noutput = \"x.png\"\nrotate_y = {from = 0, to = 99999}\n"),
                HasSubstr("jobs.toml:1:1: gives 300000 pictures"));
}

TEST_F(BatchLimits, WhatDrawsNoSamplesCountsOnce) {
    JobEntry entry;
    entry.seeds = {1, 2, 3};
    entry.samples = {1, 2};
    entry.rotations = {0, 90};
    entry.estimators = {Estimator::exact, Estimator::shared, Estimator::harmonic};
    EXPECT_EQ(pictures_of_a_map(entry), 2U * (1 + 2 * 3 + 1));
}

TEST_F(BatchLimits, OutputsAreBounded) {
    const std::string job = "[[job]]\nmap = \"a.pfm\"\n";
    EXPECT_THAT(refusal_of_jobs(job + "output = [" + repeated(17, "'x.png',") + "]\n"),
                HasSubstr("jobs.toml:3:10: output: lists 17 outputs; 16 are the most of a job"));
    EXPECT_THAT(refusal_of_jobs(job + "output = \"" + repeated(400, "{seed:020}") + ".png\"\n"),
                HasSubstr("jobs.toml:3:10: output: a name has"));
    std::string outputs;
    for (int o = 0; o < 16; ++o) outputs += fmt::format("\"{}{}_{{seed}}.png\",", std::string(3000, 'x'), o);
    EXPECT_THAT(refusal_of_jobs(job + "seed = [" + numbered(5000, [](auto i) { return fmt::format("{},", i); }) +
                                "]\noutput = [" + outputs + "]\n"),
                HasSubstr("are the most of one batch; split the file or shorten them"));
}

TEST_F(BatchLimits, PatternsAreCountedBeforeTheyAreExpanded) {
    const auto refused = [&](const std::string& pattern) {
        return refusal_of_jobs("[[job]]\nmap = '" + pattern + "'\noutput = \"x.png\"\n");
    };
    EXPECT_THAT(
        refused(repeated(24, "{a,b}")),
        HasSubstr("jobs.toml:2:7: map: the pattern stands for 16777216 names by its braces; 4096 are the most"));
    EXPECT_THAT(refused(repeated(64, "{a,b}")), HasSubstr("18446744073709551615 names"));
    EXPECT_THAT(refused(repeated(1000, "{") + "a,b" + repeated(1000, "}")),
                HasSubstr("the pattern opens 1000 braces; 64 are the most"));
    EXPECT_THAT(refused(repeated(1500, "*/")), HasSubstr("the pattern goes through 15"));
    // Each finds a.pfm, and has 4096 alternatives.
    const std::string groups = repeated(5, "{,a,b,c}");
    const std::string lists =
        numbered(60, [&](std::size_t i) { return fmt::format("'{{a.pfm,b,c,{}}}{}',", i, groups); });
    EXPECT_THAT(refusal_of_jobs("[[job]]\nmap = [" + lists + "]\noutput = \"x.png\"\n"),
                HasSubstr("the patterns up to this one stand for 200704 names; 200000 are the most of one batch"));
}

/// Calls of glob(3) for a name without wildcards: one for each that it makes of braces.
std::size_t names_made = 0;

TEST_F(BatchLimits, AlternativesAreThoseOfGlob) {
    EXPECT_EQ(alternatives_of("a"), 1U);
    EXPECT_EQ(alternatives_of("{a,b}"), 2U);
    EXPECT_EQ(alternatives_of("{a,b{c,d,e}}f{,g}"), 8U);
    EXPECT_EQ(alternatives_of("\\{a,b\\}"), 1U);
    EXPECT_EQ(alternatives_of("{a\\},b}"), 2U);
    std::mt19937 random(1);
    for (int round = 0; round < 2000; ++round) {
        std::string pattern;
        for (int i = 0; i < 14; ++i) pattern += "{{{}},,\\ab"[random() % 10];
        if (alternatives_of(pattern) > 1000) continue;
        glob_t found{};
        found.gl_opendir = [](const char*) -> void* { return nullptr; };
        found.gl_readdir = [](void*) -> dirent* { return nullptr; };
        found.gl_closedir = [](void*) {};
        found.gl_stat = found.gl_lstat = [](const char*, struct stat*) {
            ++names_made;
            return -1;
        };
        names_made = 0;
        ::glob(pattern.c_str(), GLOB_BRACE | GLOB_ALTDIRFUNC, nullptr, &found);
        ::globfree(&found);
        EXPECT_LE(names_made, alternatives_of(pattern)) << pattern;
    }
}

/// A report as `merge` writes it, of two jobs, one shard of two.
json small_report(const std::string& file = "jobs.toml") {
    const json job = {{"index", 0}, {"status", "done"}, {"outputs", {"/dev/null"}}, {"seconds", {{"read", 0.5}}}};
    return {{"version", "0"}, {"file", file}, {"plan", "p"},   {"plan_jobs", 2},
            {"shards", 2},    {"shard", 1},   {"jobs", {job}}, {"seconds", {{"total", 1}}}};
}

TEST_F(BatchLimits, ReportsThatClaimTooMuchAreRefused) {
    const auto refused = [&](const std::string& key, const json& value) {
        json report = small_report();
        report[json::json_pointer(key)] = value;
        return refusal_of_report(report.dump());
    };
    const std::string lead = "batch.json: is no report of `clerestory batch`: ";
    EXPECT_THAT(refused("/plan_jobs", 300000000),
                HasSubstr(lead + "it claims 300000000 plan_jobs; 200000 are the most of one batch"));
    EXPECT_THAT(refused("/shards", 3000000000), HasSubstr(lead + "it claims 3000000000 shards; 200000 are the most"));
    EXPECT_THAT(refused("/jobs/0/index", 2), HasSubstr(lead + "it tells of job 2, and the batch has 2"));
    EXPECT_THAT(refused("/shard", 3), HasSubstr(lead + "it claims 3 shard; 2 are the most"));
    EXPECT_THAT(refused("/shard", 0), HasSubstr(lead + "shards count from 1"));
    EXPECT_THAT(refused("/shards_present", {1, 7}), HasSubstr(lead + "it claims 7 shard"));
    EXPECT_THAT(refused("/extra", json::array({json::parse(repeated(8, "[") + repeated(8, "]"))})),
                HasSubstr(lead + "it has 9 levels; 8 are the most"));
    EXPECT_THAT(refused("/extra", std::vector<json>(200, json::array())), HasSubstr("lists beside those of its jobs"));
    EXPECT_THAT(refused("/jobs/0/extra", std::vector<int>(200, 1)), HasSubstr("values of a job"));
    EXPECT_THAT(refusal_of_report("{\"a\": \"" + std::string(1000000, 'x') + "\"}"),
                HasSubstr(lead + "a string in it has more than 32760 bytes"));
    EXPECT_THAT(refusal_of_report(repeated(1000000, "[")), HasSubstr(lead + "it has 9 levels"));
    EXPECT_THAT(refusal_of_report("[" + repeated(1000000, "1,") + "1]"), HasSubstr("it has 201001 values"));
}

TEST_F(BatchLimits, ReportsWithWrongWordsAreRefused) {
    for (const auto& [key, value] :
         std::vector<std::pair<const char*, json>>{{"/jobs/0/status", "finished"},
                                                   {"/jobs/0/status", 1},
                                                   {"/jobs/0/index", -1},
                                                   {"/jobs/0/index", 0.5},
                                                   {"/jobs/0/outputs", "x"},
                                                   {"/jobs/0/outputs/0", 1},
                                                   {"/jobs/0/outputs/0", std::string(5000, 'x')},
                                                   {"/jobs/0/error", 1},
                                                   {"/jobs/0/seconds/read", -1},
                                                   {"/jobs/0/seconds", "x"},
                                                   {"/jobs/0", 1},
                                                   {"/jobs", json::object()},
                                                   {"/jobs", nullptr},
                                                   {"/seconds/total", -1},
                                                   {"/seconds/total", "x"},
                                                   {"/plan_jobs", -2},
                                                   {"/shards", 1.5},
                                                   {"/shard", "1"},
                                                   {"/plan", 1},
                                                   {"/file", ""},
                                                   {"/file", std::string(5000, 'x')}}) {
        json report = small_report();
        report[json::json_pointer(key)] = value;
        EXPECT_THAT(refusal_of_report(report.dump()), HasSubstr("batch.json: is no report of")) << key << " " << value;
    }
    std::string infinite = small_report().dump();
    infinite.replace(infinite.find("0.5"), 3, "1e999");
    EXPECT_THAT(refusal_of_report(infinite), HasSubstr("is no report"));
    EXPECT_THAT(refusal_of_report(""), HasSubstr("is no report"));
}

TEST_F(BatchLimits, WhatIsMissingIsToldInFewLines) {
    json report = small_report();
    report["plan_jobs"] = MOST_PICTURES;
    report["shards"] = MOST_PICTURES;
    report["shard"] = 3;
    report["jobs"][0]["index"] = 5;
    write_raw(folder_.path() / "batch.json", report.dump());
    const ProgramResult result = run_program({"merge", folder_.file("batch.json")});
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr("shard 2/200000: no report; run `clerestory batch jobs.toml --shard 2/200000 "
                                      "--resume`"));
    EXPECT_THAT(result.err, Not(HasSubstr("shard 3/200000")));
    EXPECT_THAT(result.err, HasSubstr("shards 22-200000: no report either"));
    EXPECT_THAT(result.err, HasSubstr("jobs 0-4, 6-199999: in no report"));
    EXPECT_LT(std::count(result.err.begin(), result.err.end(), '\n'), 30);
}

/// The line that merge says of the second shard, which is missing.
std::string command_for(const TempFolder& folder, const std::string& job_file) {
    write_raw(folder.path() / "batch.json", small_report(job_file).dump());
    const ProgramResult result = run_program({"merge", folder.file("batch.json")});
    EXPECT_EQ(result.exit_code, 1) << result.err;
    const auto begin = result.err.find("run `") + 5;
    return result.err.substr(begin, result.err.find('\n', begin) - begin);
}

TEST_F(BatchLimits, SuggestedCommandsAreSafeToPaste) {
    EXPECT_THAT(command_for(folder_, "my jobs.toml"), StartsWith("clerestory batch 'my jobs.toml' --shard 2/2"));
    EXPECT_THAT(command_for(folder_, "$(touch x).toml"), StartsWith("clerestory batch '$(touch x).toml' --shard 2/2"));
    EXPECT_THAT(command_for(folder_, "it's; `rm`"), StartsWith("clerestory batch 'it'\\''s; `rm`' --shard 2/2"));
    EXPECT_THAT(command_for(folder_, "-o.toml"), StartsWith("clerestory batch ./-o.toml --shard 2/2"));
    for (const char* controls : {"a\nb.toml", "a\x1b[2J.toml", "a\u009b2J.toml"}) {
        const std::string said = command_for(folder_, controls);
        EXPECT_THAT(said, StartsWith("clerestory batch $'a\\")) << said;
        EXPECT_EQ(said.find('\x1b'), std::string::npos);
        EXPECT_EQ(said.find("\u009b"), std::string::npos);
    }
}

TEST_F(BatchLimits, AFailuresWordsStayOnTheirLine) {
    json report = small_report();
    report["jobs"][0]["status"] = "failed";
    report["jobs"][0]["error"] = "a\nwarning: \x1b[2J" + std::string(5000, 'x');
    write_raw(folder_.path() / "batch.json", report.dump());
    const ProgramResult result = run_program({"merge", folder_.file("batch.json")});
    EXPECT_THAT(result.err, HasSubstr("job 0: failed: a\\nwarning: \\x1b[2Jxxx"));
    EXPECT_LT(result.err.size(), 2000U);
}

}  // namespace
}  // namespace clerestory::test
