// Job files: what they may say, and that every mistake is named with its place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "batch/job_file.hpp"
#include "batch/pattern.hpp"
#include "batch/plan.hpp"
#include "batch/report.hpp"
#include "error.hpp"
#include "image_files.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::uint64_t SEED = 7;

class BatchJobFile : public ::testing::Test {
  protected:
    JobFile read(const std::string& text) {
        write_raw(folder_.path() / "jobs.toml", text);
        return read_job_file(folder_.path() / "jobs.toml", SEED);
    }
    /// What reading, or else planning, says about a file that is wrong; file names without their folder.
    std::string mistake_in(const std::string& text) {
        try {
            make_plan(read(text), {});
        } catch (const InputError& error) {
            std::string said = error.what();
            const std::string folder = folder_.path().string() + "/";
            for (auto at = said.find(folder); at != std::string::npos; at = said.find(folder))
                said.erase(at, folder.size());
            return said;
        }
        return "accepted";
    }
    void make_map(const std::string& name, int width = 4, int height = 2) {
        std::filesystem::create_directories((folder_.path() / name).parent_path());
        const auto texels = ramp(static_cast<std::size_t>(width * height));
        ExrLayout layout;
        layout.width = width;
        layout.height = height;
        write_test_exr(folder_.path() / name, layout, {{"Y", Imf::FLOAT, texels}});
    }
    TempFolder folder_;
};

TEST_F(BatchJobFile, DefaultsAreFilledInAndOverridden) {
    const JobFile file = read(R"(
        [defaults]
        samples = [64, 256]
        exposure = 2
        output = "{map}.png"
        [[job]]
        map = "a.exr"
        [[job]]
        map = ["b.exr", "c.exr"]
        samples = 16
        seed = 3
        flip_y = true
        luminance = "rec709"
        control_degree = 0
        size = 33)");
    ASSERT_EQ(file.jobs.size(), 2U);
    EXPECT_THAT(file.jobs[0].samples, ElementsAre(64, 256));
    EXPECT_THAT(file.jobs[0].seeds, ElementsAre(SEED));
    EXPECT_EQ(file.jobs[0].recipe.render.sampling.control_degree, DEFAULT_CONTROL_DEGREE);
    EXPECT_EQ(file.jobs[0].recipe.render.size, RenderOptions{}.size);
    EXPECT_FALSE(file.jobs[0].recipe.map.flip_y);
    EXPECT_EQ(file.jobs[1].maps.size(), 2U);
    EXPECT_THAT(file.jobs[1].samples, ElementsAre(16));
    EXPECT_THAT(file.jobs[1].seeds, ElementsAre(3));
    EXPECT_TRUE(file.jobs[1].recipe.map.flip_y);
    EXPECT_EQ(file.jobs[1].recipe.map.luminance, "rec709");
    EXPECT_EQ(file.jobs[1].recipe.tone.exposure, 2);
    EXPECT_EQ(file.jobs[1].recipe.render.sampling.control_degree, 0U);
    EXPECT_EQ(file.jobs[1].recipe.render.size, 33U);
}

TEST_F(BatchJobFile, RotationsAreListsOrRanges) {
    const auto rotations = [&](const std::string& value) {
        return read("[[job]]\nmap = \"a\"\noutput = \"o.png\"\nrotate_y = " + value).jobs.at(0).rotations;
    };
    EXPECT_THAT(rotations("90"), ElementsAre(90));
    EXPECT_THAT(rotations("[0, 22.5, -90]"), ElementsAre(0, 22.5, -90));
    EXPECT_THAT(rotations("{from = 0, to = 3}"), ElementsAre(0, 1, 2, 3));
    EXPECT_THAT(rotations("{from = 10, to = 0, step = -4}"), ElementsAre(10, 6, 2));
    EXPECT_EQ(rotations("{from = 0, to = 0.3, step = 0.1}").size(), 4U);
    EXPECT_THAT(rotations("[{from = 0, to = 1}, 45]"), ElementsAre(0, 1, 45));
}

TEST_F(BatchJobFile, EveryMistakeIsNamedWithItsPlaceAndWhatWouldBeRight) {
    const std::string text =
        "[defaults]\n"
        "rotations = [0]\n"
        "[[job]]\n"
        "map = 3\n"
        "samples = [0, 16]\n"
        "estimator = \"shard\"\n"
        "sequence = []\n"
        "colour = 1\n"
        "flip_y = \"yes\"\n"
        "scale = -1\n"
        "rotate_y = {from = 0, to = 10, step = -1}\n"
        "output = [\"a.jpg\", \"{mapp}.png\", \"{map:03}.png\", \"{map.png\"]\n"
        "[[jobs]]\n";
    const std::string said = mistake_in(text);
    for (const char* line :
         {"jobs.toml:2:1: unknown key \"rotations\"; did you mean \"rotate_y\"?",
          "jobs.toml:4:7: map: 3 is given; it takes a string in quotes",
          "jobs.toml:5:12: samples: 0 is given; it takes a whole number from 1 to 1073741824",
          "jobs.toml:6:13: estimator: \"shard\" is given; it takes one of shared, per-pixel, exact, harmonic; did you "
          "mean \"shared\"?",
          "jobs.toml:7:12: sequence: the list is empty", "jobs.toml:8:1: unknown key \"colour\"",
          "jobs.toml:9:10: flip_y: \"yes\" is given; it takes true or false", "jobs.toml:10:9: scale: -1 is given",
          "jobs.toml:11:12: rotate_y: steps of -1 never lead from 0 to 10; change the step's sign",
          "jobs.toml:12:11: output: a.jpg: a picture ends in .exr or .png",
          "jobs.toml:12:20: output: \"{mapp}.png\" has no field {mapp}; did you mean {map}?",
          "jobs.toml:12:34: output: \"{map:03}.png\": {map:03} cannot be written",
          "jobs.toml:12:50: output: \"{map.png\" has a lone {", "jobs.toml:13:3: unknown key \"jobs\""}) {
        EXPECT_THAT(said, HasSubstr(line));
    }
    EXPECT_LT(said.find("jobs.toml:2:"), said.find("jobs.toml:4:")) << "in the file's order";
}

TEST_F(BatchJobFile, AMistakeIsOneLineWhateverTheFileHolds) {
    EXPECT_THAT(mistake_in("[[job]]\nestimator = \"a\\nb\\u001b[2J\""),
                HasSubstr("jobs.toml:2:13: estimator: \"a\\nb\\x1b[2J\" is given"));
    EXPECT_THAT(mistake_in("\"sam\\nples\" = 4\n"), HasSubstr("unknown key \"sam\\nples\""));
    const std::string said = mistake_in("[[job]]\nmap\n= 1\n");  // the parser's own words, on a line's end
    EXPECT_THAT(said, HasSubstr("jobs.toml:2:"));
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
}

TEST_F(BatchJobFile, WhatIsNoJobFileIsRefused) {
    EXPECT_THAT(mistake_in("[[job]\nmap = 1"), HasSubstr("jobs.toml:1:"));
    EXPECT_THAT(mistake_in(""), HasSubstr("there is no job; write one under [[job]]"));
    EXPECT_THAT(mistake_in("[job]\nmap = 1"), HasSubstr("write [defaults] once and [[job]] for each job"));
    EXPECT_THAT(mistake_in("samples = 4\n"), HasSubstr("\"samples\" stands outside of any job"));
    EXPECT_THAT(mistake_in("[[job]]\nsize = 9"), HasSubstr("jobs.toml:1:1: the job has no map"));
    EXPECT_THAT(mistake_in("[[job]]\nmap = \"none/*.exr\"\noutput = \"x.png\""),
                HasSubstr("jobs.toml:2:7: map: no file is named none/*.exr"));
    EXPECT_THROW(read_job_file(folder_.path() / "missing.toml", SEED), InputError);
    EXPECT_THROW(read_job_file(folder_.path(), SEED), InputError);
}

TEST_F(BatchJobFile, PatternsNameOutputsByTheirJob) {
    PatternValues values{"city", "maps", 7.25, 3, 64, "shared", "sobol", 1, 511};
    const auto expanded = [&](const std::string& text) { return Pattern(text).expand(values); };
    EXPECT_EQ(expanded("{folder}/{map}_{rotation:03}_{samples}.exr"), "maps/city_007.25_64.exr");
    EXPECT_EQ(expanded("{rotation:03.1}_{frame:04}_{samples:05}.png"), "007.2_0003_00064.png");
    EXPECT_EQ(expanded("{{{estimator}}}_{sequence}_{seed}_{size}.exr"), "{shared}_sobol_1_511.exr");
    values.rotation = -7;
    EXPECT_EQ(expanded("{rotation:03}"), "-007");
    values.rotation = 359;
    EXPECT_EQ(expanded("{rotation}"), "359");
    values.samples.reset();
    EXPECT_EQ(expanded("{samples:05}"), "none");
}

TEST_F(BatchJobFile, EveryCombinationIsAJobAndMapsStayTogether) {
    make_map("b.exr");
    make_map("a.exr");
    const std::string tail = "output = \"{map}_{rotation}_{samples}_{estimator}_{sequence}_{seed}.exr\"\n";
    const std::string text =
        "[[job]]\nmap = \"*.exr\"\nrotate_y = [0, 90]\nsamples = [4, 8]\n"
        "estimator = [\"shared\", \"exact\"]\nsequence = [\"random\", \"sobol\"]\nseed = [1, 2]\n" +
        tail + "[[job]]\nmap = \"a.exr\"\nrotate_y = 45\n" + tail;
    const Plan plan = make_plan(read(text), {});
    // Of each map 2 rotations by (2 counts, 2 sequences, 2 seeds, and `exact`, which has none of them), and one more.
    ASSERT_EQ(plan.jobs.size(), 2U * 2 * (2 * 2 * 2 + 1) + 1);
    std::set<std::string> names;
    std::size_t changes = 0;
    for (std::size_t i = 0; i < plan.jobs.size(); ++i) {
        EXPECT_EQ(plan.jobs[i].index, i);
        names.insert(plan.jobs[i].outputs.begin(), plan.jobs[i].outputs.end());
        changes += i > 0 && plan.jobs[i].recipe.map.file != plan.jobs[i - 1].recipe.map.file;
    }
    EXPECT_EQ(names.size(), plan.jobs.size());
    EXPECT_EQ(changes, 1U);
    EXPECT_TRUE(names.contains(folder_.file("b_90_none_exact_none_none.exr")));
}

TEST_F(BatchJobFile, TwoJobsWithOneOutputAreRefused) {
    make_map("x/a.exr");
    make_map("y/a.exr");
    EXPECT_THAT(mistake_in("[[job]]\nmap = \"?/a.exr\"\noutput = \"{map}.png\""),
                HasSubstr("jobs.toml:3:10: two jobs would be written to a.png; put {folder} into the name"));
    EXPECT_THAT(mistake_in("[[job]]\nmap = \"x/a.exr\"\nrotate_y = [0, 1]\noutput = \"a.png\""),
                HasSubstr("put {rotation} into the name"));
    EXPECT_THAT(mistake_in("[[job]]\nmap = \"x/a.exr\"\noutput = [\"a.png\", \"x/../a.png\"]"),
                HasSubstr("two outputs would be written to"));
    std::filesystem::create_directory_symlink(folder_.path() / "x", folder_.path() / "link");
    EXPECT_THAT(mistake_in("[[job]]\nmap = \"x/a.exr\"\noutput = [\"x/a.png\", \"link/a.png\"]"),
                HasSubstr("two outputs would be written to"));
}

TEST_F(BatchJobFile, APictureMayNotReplaceAMap) {
    std::filesystem::copy_file(std::filesystem::path(CLERESTORY_SOURCE_DIR) / "data/city.exr",
                               folder_.path() / "city.exr");
    EXPECT_THAT(mistake_in("[[job]]\nmap = \"city.exr\"\noutput = \"{map}.exr\""),
                HasSubstr("city.exr would be replaced by a picture"));
}

TEST_F(BatchJobFile, ShardsShareTheJobsAndTheCost) {
    make_map("a.exr", 64, 32);
    make_map("b.exr", 256, 128);
    const Plan plan = make_plan(read("[[job]]\nmap = \"?.exr\"\nsize = 65\nrotate_y = {from = 0, to = 36}\n"
                                     "samples = [16, 256, 4096]\noutput = \"{map}_{rotation}_{samples}.exr\""),
                                {});
    std::uint64_t dearest = 0;
    for (const Job& job : plan.jobs) dearest = std::max(dearest, job.cost_ns);
    for (const std::size_t count : {1U, 2U, 4U, 7U, 300U}) {
        std::vector<std::size_t> seen(plan.jobs.size(), 0);
        for (std::size_t number = 1; number <= count; ++number) {
            const Shard shard{number, count};
            std::uint64_t cost = 0;
            for (const Job& job : jobs_of_shard(plan, shard)) {
                ++seen[job.index];
                cost += job.cost_ns;
            }
            // The middles of its jobs lie within the share, so it is off by half a job at either end.
            EXPECT_NEAR(static_cast<double>(cost), static_cast<double>(plan.cost_ns()) / static_cast<double>(count),
                        static_cast<double>(dearest) + 1);
        }
        EXPECT_THAT(seen, ::testing::Each(1U)) << count;
    }
    for (const char* wrong : {"", "1", "0/4", "5/4", "1/0", "a/b", "1/4x", "-1/4", "1//4", "1/200001"}) {
        EXPECT_THROW(shard_by_name(wrong), UsageError) << wrong;
    }
    EXPECT_EQ(shard_name(shard_by_name("2/4")), "2/4");
}

TEST_F(BatchJobFile, APlansDigestTellsBatchesApart) {
    make_map("a.exr");
    const std::string text = "[[job]]\nmap = \"a.exr\"\noutput = \"{rotation}.exr\"\nrotate_y = [0, 1]\n";
    const std::string digest = make_plan(read(text), {}).digest;
    EXPECT_EQ(make_plan(read(text), folder_.path() / "elsewhere").digest, digest) << "wherever it is written";
    EXPECT_NE(make_plan(read(text + "samples = 8\n"), {}).digest, digest);
    make_map("a.exr", 8, 4);
    EXPECT_NE(make_plan(read(text), {}).digest, digest);
}

TEST_F(BatchJobFile, MissingNumbersAreWrittenAsRanges) {
    EXPECT_EQ(ranges_text(missing_from({}, 0, 0)), "");
    EXPECT_EQ(ranges_text(missing_from({}, 0, 200000)), "0-199999");
    EXPECT_EQ(ranges_text(missing_from({3, 4, 6}, 0, 9)), "0-2, 5, 7-8");
    EXPECT_EQ(ranges_text(missing_from({1, 2, 3}, 1, 4)), "");
    std::vector<std::size_t> even;
    for (std::size_t i = 0; i < 60; i += 2) even.push_back(i);
    EXPECT_THAT(ranges_text(missing_from(even, 0, 60)), ::testing::EndsWith("37, 39 and 10 ranges more"));
}

}  // namespace
}  // namespace clerestory::test
