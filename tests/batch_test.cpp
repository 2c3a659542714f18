// `batch` and `merge` from outside: the same pictures as `render`, whatever fails, stops or kills it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "base/digest.hpp"
#include "batch/resume.hpp"
#include "image.hpp"
#include "image_files.hpp"
#include "render/source_digest.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

/// Digests of everything in a folder, by its path there.
std::map<std::string, std::string> files_in(const fs::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = digest_of_file(entry.path());
    }
    return files;
}

/// The pictures alone, without reports, which hold times.
std::map<std::string, std::string> pictures_in(const fs::path& folder) {
    auto files = files_in(folder);
    std::erase_if(files, [](const auto& file) { return file.first.ends_with(".json"); });
    return files;
}

ReadOptions any_format() {
    ReadOptions options;
    options.oiio_module = CLERESTORY_OIIO_MODULE;
    return options;
}

/// Waits, as long as the process lives, until `folder` holds `count` files.
void wait_for_files(pid_t process, const fs::path& folder, std::size_t count) {
    const auto holds = [&] {
        std::error_code error;
        std::size_t found = 0;
        for (const auto& entry : fs::directory_iterator(folder, error)) {
            found += entry.path().filename().string().starts_with(".") ? 0 : 1;
        }
        return found >= count;
    };
    siginfo_t ended{};
    while (!holds() && waitid(P_PID, static_cast<id_t>(process), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           ended.si_pid == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
}

class Batch : public ::testing::Test {
  protected:
    Batch() {
        make_map("a.pfm", 1);
        make_map("b.pfm", 2);
    }
    void make_map(const std::string& name, float scale) {
        write_pfm(folder_.path() / name, 32, 16, ramp(std::size_t{3} * 32 * 16, scale / 64));
    }
    std::string job_file(const std::string& text, const std::string& name = "jobs.toml") {
        write_raw(folder_.path() / name, text);
        return folder_.file(name);
    }
    /// Runs a job file's text into the folder `out`.
    ProgramResult run(const std::string& text, const std::string& out, std::vector<std::string> more = {},
                      const ProgramSetting& setting = {}) {
        more.insert(more.begin(), {"batch", job_file(text), "-o", folder_.file(out)});
        return run_program(more, setting);
    }
    [[nodiscard]] json report(const std::string& name) const { return json::parse(read_file(folder_.file(name))); }

    TempFolder folder_;
    // 24 pictures of two maps, each as EXR and PNG.
    const std::string jobs_ =
        "[defaults]\nsize = 33\nsamples = 64\n"
        "[[job]]\nmap = \"?.pfm\"\nrotate_y = {from = 0, to = 330, step = 30}\n"
        "output = [\"{map}_{rotation:03}.exr\", \"{map}_{rotation:03}.png\"]\n";
};

TEST_F(Batch, PicturesAreThoseOfRender) {
    const std::string text =
        "[defaults]\nmap = \"?.pfm\"\nsize = 33\nsamples = [16, 64]\nrotate_y = [0, 90]\nseed = [1, 2]\nexposure = "
        "0.5\n"
        "[[job]]\nestimator = [\"shared\", \"per-pixel\", \"exact\", \"harmonic\"]\nsequence = [\"random\", "
        "\"sobol\"]\n"
        "output = [\"{map}_{estimator}_{sequence}_{samples}_{seed}_{rotation}.exr\", "
        "\"{map}_{estimator}_{sequence}_{samples}_{seed}_{rotation}.png\"]\n";
    ASSERT_EQ(run(text, "out").exit_code, 0);
    struct Case {
        const char* estimator;
        const char* sequence;
        const char* seed;
        const char* name;
    };
    for (const auto& [estimator, sequence, seed, name] :
         {Case{"shared", "sobol", "2", "b_shared_sobol_64_2_90"},
          Case{"shared", "random", "1", "b_shared_random_64_1_90"},
          Case{"per-pixel", "random", "2", "b_per-pixel_random_64_2_90"},
          Case{"exact", "random", "1", "b_exact_none_none_none_90"},
          Case{"harmonic", "random", "1", "b_harmonic_none_none_none_90"}}) {
        const std::string one = folder_.file(std::string("one_") + name);
        const std::string n = std::string(estimator) == "exact" || std::string(estimator) == "harmonic" ? "16" : "64";
        ASSERT_EQ(run_program({"render",      folder_.file("b.pfm"),
                               "--size",      "33",
                               "-n",          n,
                               "--rotate-y",  "90",
                               "--estimator", estimator,
                               "--sequence",  sequence,
                               "--seed",      seed,
                               "--exposure",  "0.5",
                               "-o",          one + ".exr",
                               "-o",          one + ".png",
                               "-q"})
                      .exit_code,
                  0);
        const std::string of_batch = folder_.file(std::string("out/") + name);
        for (const char* suffix : {".exr", ".png"}) {
            const Picture a = read_picture(one + suffix, any_format());
            const Picture b = read_picture(of_batch + suffix, any_format());
            EXPECT_EQ(a.rgb, b.rgb) << name << suffix;
            EXPECT_EQ(a.alpha, b.alpha) << name << suffix;
        }
        Header rendered = read_exr_header(one + ".exr");
        std::erase_if(rendered, [](const auto& value) { return value.first.starts_with("clerestory:seconds:"); });
        Header batched = read_exr_header(of_batch + ".exr");
        EXPECT_EQ(batched.erase("clerestory:digest"), 1U);
        ASSERT_EQ(batched.size(), rendered.size()) << name;
        for (const auto& [key, value] : rendered) {
            EXPECT_EQ(batched.at(key).text, value.text) << name << " " << key;
            EXPECT_EQ(batched.at(key).number, value.number) << name << " " << key;
        }
    }
}

TEST_F(Batch, TheReportTellsEveryJob) {
    const ProgramResult result = run(jobs_, "out", {"--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr("24 done, 0 skipped, 0 failed"));
    const json said = json::parse(result.out);
    EXPECT_EQ(said, report("out/batch.json"));
    EXPECT_EQ(said["counts"]["done"], 24);
    EXPECT_EQ(said["plan_jobs"], 24);
    ASSERT_EQ(said["jobs"].size(), 24U);
    const json& job = said["jobs"][13];
    EXPECT_EQ(job["index"], 13);
    EXPECT_EQ(job["status"], "done");
    EXPECT_EQ(job["rotate_y"], 30);
    EXPECT_EQ(job["outputs"][0], folder_.file("out/b_030.exr"));
    for (const char* stage : {"draw", "shade", "compose", "preview", "write"}) {
        EXPECT_TRUE(job["seconds"][stage].is_number()) << stage;
    }
    EXPECT_TRUE(said["jobs"][12]["seconds"].contains("read")) << "with its map's first picture";
    EXPECT_FALSE(job["seconds"].contains("read")) << "a rotation needs no new table";
    EXPECT_FALSE(job["seconds"].contains("tables"));
}

TEST_F(Batch, DryRunListsJobsAndWritesNothing) {
    const ProgramResult text = run(jobs_, "out", {"--dry-run"});
    EXPECT_EQ(text.exit_code, 0) << text.err;
    EXPECT_EQ(std::count(text.out.begin(), text.out.end(), '\n'), 25);
    EXPECT_THAT(text.out, HasSubstr("24 jobs, about"));
    const ProgramResult listed = run(jobs_, "out", {"--dry-run", "--json", "-", "--shard", "2/2"});
    const json plan = json::parse(listed.out);
    EXPECT_EQ(plan["jobs"].size(), 12U);
    EXPECT_GT(plan["estimated_seconds"].get<double>(), 0);
    EXPECT_GT(plan["memory_bytes"].get<double>(), 0);
    EXPECT_FALSE(fs::exists(folder_.file("out")));
}

/// The version may stand still while kernels change.
TEST_F(Batch, APicturesDigestCoversTheCodeThatMadeItAndHowTheMapWasRead) {
    EXPECT_EQ(source_digest().size(), 64U);
    EXPECT_EQ(source_digest().find_first_not_of("0123456789abcdef"), std::string_view::npos);
    PictureRecipe recipe;
    const std::string digest = picture_digest(recipe, "map", false);
    EXPECT_EQ(picture_digest(recipe, "map", false), digest);
    EXPECT_NE(picture_digest(recipe, "another", false), digest);
    recipe.map.layer = "sky";
    const std::string of_layer = picture_digest(recipe, "map", false);
    EXPECT_NE(of_layer, digest);
    recipe.map.layer.clear();
    recipe.map.part = 1;
    EXPECT_NE(picture_digest(recipe, "map", false), digest);
    EXPECT_NE(picture_digest(recipe, "map", false), of_layer);
}

TEST_F(Batch, ResumeSkipsWhatIsDoneAndUnchanged) {
    ASSERT_EQ(run(jobs_, "out").exit_code, 0);
    const auto first = pictures_in(folder_.file("out"));
    const auto resumed = [&](const std::string& text) {
        const ProgramResult result = run(text, "out", {"--resume"});
        EXPECT_EQ(result.exit_code, 0) << result.err;
        EXPECT_EQ(report("out/batch.json")["counts"]["done"].get<int>() +
                      report("out/batch.json")["counts"]["skipped"].get<int>(),
                  24);
        return report("out/batch.json")["counts"]["done"].get<int>();
    };
    const auto written = fs::last_write_time(folder_.file("out/a_000.exr"));
    EXPECT_EQ(resumed(jobs_), 0);
    EXPECT_EQ(fs::last_write_time(folder_.file("out/a_000.exr")), written);

    // Missing, cut short, or of other making.
    fs::remove(folder_.file("out/a_000.exr"));
    fs::resize_file(folder_.file("out/a_030.png"), 100);
    fs::resize_file(folder_.file("out/b_060.exr"), fs::file_size(folder_.file("out/b_060.exr")) - 1000);
    fs::copy_file(folder_.file("out/b_000.png"), folder_.file("out/b_090.png"), fs::copy_options::overwrite_existing);
    EXPECT_EQ(resumed(jobs_), 4);
    EXPECT_EQ(pictures_in(folder_.file("out")), first);

    // Another parameter; one of the previews only; another map.
    EXPECT_EQ(resumed(jobs_ + "exposure = 2\n"), 24);
    EXPECT_EQ(resumed(jobs_ + "exposure = 2\n"), 0);
    EXPECT_EQ(resumed(jobs_ + "exposure = 2\nalbedo = 0.5\n"), 24);
    make_map("b.pfm", 3);
    EXPECT_EQ(resumed(jobs_ + "exposure = 2\nalbedo = 0.5\n"), 12);
    EXPECT_EQ(resumed(jobs_), 24);
}

TEST_F(Batch, AFailureIsItsJobsOwn) {
    write_raw(folder_.path() / "broken.exr", "this is no picture\n");
    write_raw(folder_.path() / "file", "where a folder should be\n");
    write_pfm(folder_.path() / "nan.pfm", 2, 1, {NAN, 1, 1, 1, 1, 1});
    fs::create_directory(folder_.path() / "out");
    fs::create_symlink("/dev/full", folder_.path() / "out/full.exr");
    fs::create_symlink("/dev/full", folder_.path() / "out/full.png");
    const ProgramResult result =
        run("[defaults]\nsize = 9\nsamples = 4\noutput = \"{map}.exr\"\n"
            "[[job]]\nmap = [\"a.pfm\", \"broken.exr\", \"nan.pfm\"]\n"
            "[[job]]\nmap = \"b.pfm\"\noutput = \"full.exr\"\n"
            "[[job]]\nmap = \"b.pfm\"\nsamples = 5\noutput = \"full.png\"\n"
            "[[job]]\nmap = \"b.pfm\"\noutput = \"" +
                folder_.file("file") + "/x.exr\"\n[[job]]\nmap = \"b.pfm\"\n",
            "out");
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr("clerestory: 5 of 7 jobs failed"));
    const json jobs = report("out/batch.json")["jobs"];
    const auto expect = [&](std::size_t job, const char* status, int code, const char* words) {
        EXPECT_EQ(jobs[job]["status"], status) << jobs[job];
        EXPECT_EQ(jobs[job].value("exit_code", 0), code) << jobs[job];
        EXPECT_THAT(jobs[job].value("error", ""), HasSubstr(words));
    };
    expect(0, "done", 0, "");
    expect(1, "failed", 3, "broken.exr: is not an EXR file");
    expect(2, "failed", 3, "nan.pfm: 1 NaN");
    expect(3, "failed", 5, "No space left on device");
    expect(4, "failed", 5, "No space left on device");
    expect(5, "failed", 5, "file/x.exr");
    expect(6, "done", 0, "");
    EXPECT_EQ(names_in(folder_.path() / "out"),
              (std::vector<std::string>{"a.exr", "b.exr", "batch.json", "full.exr", "full.png"}));
}

TEST_F(Batch, RepairedAndBlackMapsAreRenderedWithAWarning) {
    write_pfm(folder_.path() / "nan.pfm", 2, 1, {NAN, 1, 1, 1, 1, 1});
    write_pfm(folder_.path() / "black.pfm", 2, 1, {0, 0, 0, 0, 0, 0});
    const ProgramResult result =
        run("[[job]]\nmap = [\"nan.pfm\", \"black.pfm\"]\nsize = 9\nsamples = 4\nbad_texels = \"zero\"\noutput = "
            "\"{map}.exr\"\n",
            "out", {"-v"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr("nan.pfm: 1 NaN, infinite or negative texels were blackened"));
    EXPECT_THAT(result.err, HasSubstr("black.pfm: the map is black"));
    EXPECT_THAT(result.err, HasSubstr(folder_.file("out/nan.exr"))) << "-v names each picture";
    const Picture black = read_picture(folder_.file("out/black.exr"), any_format());
    EXPECT_THAT(black.rgb, ::testing::Each(0.0F));
}

TEST_F(Batch, AMapReplacedOrDeletedHalfWayFailsItsRemainingJobs) {
    for (const bool deleted : {false, true}) {
        const std::string out = deleted ? "deleted" : "replaced";
        const ProgramResult result = run(jobs_ +
                                             "[[job]]\nmap = \"b.pfm\"\nsize = 511\nrotate_y = {from = 0, to = "
                                             "399}\noutput = \"z_{rotation:03}.exr\"\n",
                                         out, {}, {.environment = {}, .folder = {}, .meanwhile = [&](pid_t process) {
                                                       wait_for_files(process, folder_.path() / out, 24 + 26);
                                                       fs::remove(folder_.path() / "b.pfm");
                                                       if (!deleted) make_map("b.pfm", 5);
                                                   }});
        EXPECT_EQ(result.exit_code, 1) << result.err;
        const json said = report(out + "/batch.json");
        EXPECT_GE(said["counts"]["done"], 25);
        EXPECT_GE(said["counts"]["failed"], 1);
        EXPECT_EQ(said["counts"]["not run"], 0);
        const json& last = said["jobs"].back();
        EXPECT_EQ(last["exit_code"], 3);
        EXPECT_THAT(last.value("error", ""), HasSubstr(deleted ? "no such file" : "was replaced or changed"));
        make_map("b.pfm", 2);
    }
}

TEST_F(Batch, ASignalEndsItCleanlyAndResumeGoesOn) {
    const std::string text =
        "[[job]]\nmap = \"?.pfm\"\nsamples = 64\nrotate_y = {from = 0, to = 199}\noutput = "
        "\"{map}_{rotation:03}.exr\"\n";
    for (const int signal : {SIGINT, SIGTERM}) {
        const std::string out = signal == SIGINT ? "int" : "term";
        const ProgramResult stopped =
            run(text, out, {}, {.environment = {}, .folder = {}, .meanwhile = [&](pid_t process) {
                                    wait_for_files(process, folder_.path() / out, 5);
                                    kill(process, signal);
                                }});
        EXPECT_EQ(stopped.exit_code, 128 + signal) << stopped.err;
        EXPECT_THAT(stopped.err, HasSubstr("go on with --resume"));
        const json said = report(out + "/batch.json");
        EXPECT_TRUE(said["stopped"].get<bool>());
        EXPECT_GE(said["counts"]["done"], 5);
        EXPECT_GE(said["counts"]["not run"], 1);
        EXPECT_EQ(pictures_in(folder_.path() / out).size(), said["counts"]["done"])
            << "whole pictures, and nothing else";
    }
}

TEST_F(Batch, KilledAndResumedItLosesNothing) {
    ASSERT_EQ(run(jobs_, "whole").exit_code, 0);
    const auto whole = pictures_in(folder_.file("whole"));
    std::map<std::string, fs::file_time_type> kept;
    for (std::size_t files = 1; files < 48; files += 9) {
        run(jobs_, "killed", {"--resume"}, {.environment = {}, .folder = {}, .meanwhile = [&](pid_t process) {
                                                wait_for_files(process, folder_.path() / "killed", files);
                                                kill(process, SIGKILL);
                                            }});
        for (const auto& [name, time] : kept)
            EXPECT_EQ(fs::last_write_time(folder_.file("killed/" + name)), time) << name;
        for (const auto& [name, digest] : pictures_in(folder_.file("killed"))) {
            if (name.starts_with(".")) continue;  // what the next run removes
            EXPECT_EQ(digest, whole.at(name)) << name;
            const std::string job = name.substr(0, name.size() - 4);
            const bool both = fs::exists(folder_.file("killed/" + job + ".exr")) &&
                              fs::exists(folder_.file("killed/" + job + ".png"));
            if (both) kept[name] = fs::last_write_time(folder_.file("killed/" + name));
        }
    }
    EXPECT_EQ(run(jobs_, "killed", {"--resume"}).exit_code, 0);
    EXPECT_EQ(pictures_in(folder_.file("killed")), whole);
    EXPECT_FALSE(kept.empty());
}

TEST_F(Batch, FourShardsTogetherAreTheWhole) {
    ASSERT_EQ(run(jobs_, "whole").exit_code, 0);
    std::vector<std::string> reports;
    for (int shard = 1; shard <= 4; ++shard) {
        // The second as a task of a Slurm array whose numbers begin at 10 and go up by 5.
        std::vector<std::string> more = {"--shard", std::to_string(shard) + "/4"};
        ProgramSetting setting;
        if (shard == 2) {
            more.clear();
            setting.environment = {{"SLURM_ARRAY_TASK_ID", "15"},
                                   {"SLURM_ARRAY_TASK_MIN", "10"},
                                   {"SLURM_ARRAY_TASK_MAX", "25"},
                                   {"SLURM_ARRAY_TASK_STEP", "5"},
                                   {"SLURM_ARRAY_TASK_COUNT", "4"}};
        }
        const ProgramResult result = run(jobs_, "parts", more, setting);
        ASSERT_EQ(result.exit_code, 0) << result.err;
        reports.push_back(folder_.file("parts/batch-" + std::to_string(shard) + "-of-4.json"));
    }
    EXPECT_EQ(pictures_in(folder_.file("parts")), pictures_in(folder_.file("whole")));

    std::vector<std::string> words = {"merge", "--json", folder_.file("parts/batch.json")};
    words.insert(words.end(), reports.begin(), reports.end());
    const ProgramResult merged = run_program(words);
    EXPECT_EQ(merged.exit_code, 0) << merged.err;
    const json all = report("parts/batch.json");
    EXPECT_EQ(all["jobs"].size(), 24U);
    EXPECT_EQ(all["counts"]["done"], 24);
    for (std::size_t i = 0; i < 24; ++i) EXPECT_EQ(all["jobs"][i]["index"], i);

    // One report missing, one output gone.
    fs::remove(folder_.file("parts/a_000.exr"));
    const ProgramResult part = run_program({"merge", reports[0], reports[1], reports[3], "--json", "-"});
    EXPECT_EQ(part.exit_code, 1);
    EXPECT_THAT(part.err, HasSubstr("shard 3/4: no report; run `clerestory batch " + folder_.file("jobs.toml") +
                                    " --shard 3/4 --resume`"));
    EXPECT_THAT(part.err, HasSubstr("in no report"));
    EXPECT_THAT(part.err, HasSubstr("a_000.exr: was written and is not there any more"));
    EXPECT_EQ(json::parse(part.out)["counts"]["lost"], 1);
}

TEST_F(Batch, MergeRefusesWhatIsNoReportOrOfAnotherBatch) {
    ASSERT_EQ(run(jobs_, "one", {"--shard", "1/2"}).exit_code, 0);
    ASSERT_EQ(run(jobs_ + "seed = 2\n", "two", {"--shard", "2/2"}).exit_code, 0);
    const ProgramResult other =
        run_program({"merge", folder_.file("one/batch-1-of-2.json"), folder_.file("two/batch-2-of-2.json")});
    EXPECT_EQ(other.exit_code, 3);
    EXPECT_THAT(other.err, HasSubstr("is of another batch"));
    EXPECT_EQ(run_program({"merge", folder_.file("jobs.toml")}).exit_code, 3);
    EXPECT_EQ(run_program({"merge", folder_.file("missing.json")}).exit_code, 3);
    EXPECT_EQ(run_program({"merge"}).exit_code, 2);
}

TEST_F(Batch, ADeviceThatCannotBeOpenedFailsEveryJob) {
    const ProgramResult result = run(jobs_, "out", {"--device", "9:9"});
    EXPECT_EQ(result.exit_code, 4) << result.err;
    const json said = report("out/batch.json");
    EXPECT_EQ(said["counts"]["failed"], 24);
    EXPECT_THAT(said["jobs"][0].value("error", ""), HasSubstr("no OpenCL device 9:9"));
    EXPECT_EQ(pictures_in(folder_.file("out")).size(), 0U);
    EXPECT_EQ(run(jobs_, "out", {"--device", "first"}).exit_code, 2);
}

/// Leaves PoCL what its cache holds and no room for more: it keeps a program in a folder that two letters of A to P
/// name, and now a file stands in the place of each other one.
void block_pocl_cache(const fs::path& cache) {
    fs::create_directories(cache);
    for (char a = 'A'; a <= 'P'; ++a) {
        for (char b = 'A'; b <= 'P'; ++b) {
            const fs::path place = cache / (std::string{a} + b);
            if (!fs::exists(place)) write_raw(place, "");
        }
    }
}

TEST_F(Batch, ADeviceThatFailsToBuildFailsEveryJob) {
    // PoCL has nowhere to put its kernels, and no program is kept from before.
    block_pocl_cache(folder_.path() / "pocl");
    const ProgramResult result = run(
        jobs_, "out", {},
        {.environment = {{"POCL_CACHE_DIR", folder_.file("pocl")}, {"CLERESTORY_CACHE_DIR", folder_.file("cache")}}});
    EXPECT_EQ(result.exit_code, 4) << result.err;
    const json said = report("out/batch.json");
    EXPECT_EQ(said["counts"]["failed"], 24);
    EXPECT_EQ(said["jobs"][0]["exit_code"], 4);
    EXPECT_THAT(said["jobs"][0].value("error", ""), HasSubstr("CL_BUILD_PROGRAM_FAILURE"));
}

TEST_F(Batch, AKernelThatCannotBeBuiltFailsOnlyTheJobsThatNeedIt) {
    // PoCL has what `exact` needs in its cache, and no room for more. `shared` needs two programs more.
    const fs::path kept = folder_.path() / "pocl";
    // The device has been asked for known answers already: that takes every kernel.
    fs::create_directories(folder_.path() / "answers");
    ASSERT_EQ(run(jobs_, "asked", {}, {.environment = {{"CLERESTORY_CACHE_DIR", folder_.file("answers")}}}).exit_code,
              0);
    for (const std::string& name : names_in(folder_.path() / "answers")) {
        if (read_file(folder_.path() / "answers" / name).find("answered ") == std::string::npos) continue;
        for (const char* programs : {"first", "second", "third"}) {
            fs::create_directories(folder_.path() / programs);
            fs::copy_file(folder_.path() / "answers" / name, folder_.path() / programs / name);
        }
    }
    const auto run_in_cache = [&](const std::string& estimators, const std::string& out, const std::string& programs) {
        return run(
            "[[job]]\nmap = \"?.pfm\"\nsize = 33\nestimator = [" + estimators +
                "]\noutput = \"{map}_{estimator}.exr\"\n",
            out, {},
            {.environment = {{"POCL_CACHE_DIR", kept.string()}, {"CLERESTORY_CACHE_DIR", folder_.file(programs)}},
             .folder = {},
             .meanwhile = {}});
    };
    ASSERT_EQ(run_in_cache("\"exact\"", "whole", "first").exit_code, 0);
    block_pocl_cache(kept);

    const ProgramResult some = run_in_cache("\"shared\", \"exact\"", "out", "second");
    EXPECT_EQ(some.exit_code, 1) << some.err;
    EXPECT_THAT(some.err, HasSubstr("clerestory: 2 of 4 jobs failed"));
    for (const json& job : report("out/batch.json")["jobs"]) {
        if (job["estimator"] == "exact") {
            EXPECT_EQ(job["status"], "done") << job;
        } else {
            EXPECT_EQ(job["status"], "failed") << job;
            EXPECT_EQ(job["exit_code"], 4);
            EXPECT_THAT(job.value("error", ""), HasSubstr("building kernels/stage"));
        }
    }
    EXPECT_EQ(pictures_in(folder_.file("out")), pictures_in(folder_.file("whole")));

    const ProgramResult none = run_in_cache("\"shared\"", "none", "third");
    EXPECT_EQ(none.exit_code, 4) << "no job can run: " << none.err;
    EXPECT_EQ(report("none/batch.json")["counts"]["failed"], 2);
}

TEST_F(Batch, UsageErrorsEndWithTwoAndJobFilesWithThree) {
    EXPECT_EQ(run(jobs_, "out", {"--shard", "5/4"}).exit_code, 2);
    EXPECT_EQ(run_program({"batch"}).exit_code, 2);
    EXPECT_EQ(run_program({"batch", folder_.file("missing.toml")}).exit_code, 3);
    const ProgramResult wrong = run("[[job]]\nmap = \"a.pfm\"\noutput = \"x.png\"\nsample = 3\n", "out");
    EXPECT_EQ(wrong.exit_code, 3);
    EXPECT_THAT(wrong.err, HasSubstr("jobs.toml:4:1: unknown key \"sample\"; did you mean \"samples\"?"));
    const ProgramResult gaps = run(jobs_, "out", {},
                                   {.environment = {{"SLURM_ARRAY_TASK_ID", "3"},
                                                    {"SLURM_ARRAY_TASK_MIN", "0"},
                                                    {"SLURM_ARRAY_TASK_MAX", "7"},
                                                    {"SLURM_ARRAY_TASK_COUNT", "3"}},
                                    .folder = {},
                                    .meanwhile = {}});
    EXPECT_EQ(gaps.exit_code, 2);
    EXPECT_FALSE(fs::exists(folder_.file("out")));
}

TEST_F(Batch, MemoryDoesNotGrowWithTheNumberOfJobs) {
    for (int map = 0; map < 6; ++map) make_map(std::to_string(map) + "m.pfm", static_cast<float>(map + 1));
    const auto peak = [&](const std::string& maps, int last) {
        const ProgramResult result =
            run("[[job]]\nmap = \"" + maps + "\"\nsamples = 64\nrotate_y = {from = 0, to = " + std::to_string(last) +
                    "}\noutput = [\"{map}_{rotation:03}.exr\", \"{map}_{rotation:03}.png\"]\n",
                "out");
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return result.peak_kib;
    };
    const long one = peak("0m.pfm", 0);
    const long many = peak("*m.pfm", 19);
    EXPECT_LE(static_cast<double>(many), 1.2 * static_cast<double>(one)) << one << " KiB for one picture";
}

TEST_F(Batch, TheExampleRunsAsItStands) {
    const ProgramResult result = run_program(
        {"batch", (fs::path(CLERESTORY_SOURCE_DIR) / "docs/turntable.toml").string(), "-o", folder_.file("out")});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_GT(names_in(folder_.path() / "out").size(), 1U);
}

}  // namespace
}  // namespace clerestory::test
