// Nothing is ever loaded relative to the current folder: the program is started where an attacker has prepared every
// name that it might look for, and none of them may be opened.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "folder_watch.hpp"
#include "image_files.hpp"
#include "other_user.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class HostileFolder : public ::testing::Test {
  protected:
    HostileFolder() {
        const std::vector<float> texels = ramp(std::size_t{3} * 8 * 4);
        write_float_tiff(folder_.path() / "map.tif", 8, 4, 3, texels);
        write_exr_map(folder_.path() / "map.exr", texels);
        prepare();
    }

    static void write_exr_map(const fs::path& file, const std::vector<float>& rgb) {
        std::vector<std::vector<float>> planes(3);
        for (std::size_t i = 0; i < rgb.size(); ++i) planes[i % 3].push_back(rgb[i]);
        ExrLayout layout;
        layout.width = 8;
        layout.height = 4;
        write_test_exr(file, layout,
                       {{"R", Imf::FLOAT, planes[0]}, {"G", Imf::FLOAT, planes[1]}, {"B", Imf::FLOAT, planes[2]}});
    }

    /// Whatever a program that takes the current folder for its own might look for.
    void prepare() {
        const fs::path build(CLERESTORY_BUILD_DIR);
        for (const fs::path& home : {hostile_, hostile_ / "clerestory", hostile_ / "lib/clerestory",
                                     hostile_ / CLERESTORY_LIB_FOLDER / "clerestory"}) {
            fs::create_directories(home / "programs");
            fs::copy_file(CLERESTORY_HOSTILE_MODULE, home / "clerestory_oiio.so", fs::copy_options::overwrite_existing);
            if (fs::exists(build / "programs")) {
                fs::copy(build / "programs", home / "programs", fs::copy_options::overwrite_existing);
            }
            fs::create_directories(home / "data");
            write_exr_map(home / "data/city.exr", std::vector<float>(std::size_t{3} * 8 * 4, 1.0F));
        }
        std::ofstream(hostile_ / "gnuplot") << "#!/bin/sh\n: >'" << proof_.string() << "'\n";
        fs::permissions(hostile_ / "gnuplot", fs::perms::owner_all);
        for (const char* settings : {".gnuplot", "gnuplotrc"}) {
            std::ofstream(hostile_ / settings) << "system \"touch '" << proof_.string() << "'\"\n";
        }
        fs::create_directories(hostile_ / "bin/clerestory");
    }

    /// The program by its bare name, as found in `path`, started in `folder`, with an empty cache of built programs.
    ProgramResult run(const std::string& path, const std::vector<std::string>& arguments, const fs::path& folder,
                      std::map<std::string, std::string> variables = {}) {
        std::vector<std::string> words = {"env", "PATH=" + path, "clerestory"};
        words.insert(words.end(), arguments.begin(), arguments.end());
        variables["CLERESTORY_HOSTILE_PROOF"] = proof_.string();
        variables["CLERESTORY_CACHE_DIR"] = folder_.file("cache");
        variables["POCL_CACHE_DIR"] = folder_.file("pocl");  // HOME is hostile in one test
        return run_command(words, {.environment = variables, .folder = folder});
    }

    /// Runs in the hostile folders; says what was opened there.
    ProgramResult run_among_enemies(const std::string& path, const std::vector<std::string>& arguments,
                                    const std::map<std::string, std::string>& variables = {}) {
        ProgramResult last;
        for (const fs::path& folder : {hostile_, hostile_ / "bin"}) {
            fs::remove_all(folder_.path() / "cache");
            const FolderWatch watch(hostile_);
            last = run(path, arguments, folder, variables);
            EXPECT_THAT(watch.opened(), IsEmpty()) << "started in " << folder;
            EXPECT_FALSE(fs::exists(proof_)) << last.err;
        }
        return last;
    }

    /// A folder with the program alone, without its module, programs and maps.
    std::string lonely_copy() {
        const fs::path folder = folder_.path() / "lonely";
        fs::create_directory(folder);
        fs::copy_file(CLERESTORY_PROGRAM, folder / "clerestory");
        return folder.string();
    }

    TempFolder folder_;
    fs::path hostile_ = folder_.path() / "hostile";
    fs::path proof_ = folder_.path() / "proof";
    std::string program_folder_ = fs::path(CLERESTORY_PROGRAM).parent_path().string();
    const std::string system_ = "/usr/local/bin:/usr/bin:/bin";
};

TEST_F(HostileFolder, TheProgramTakesWhatIsItsOwn) {
    const std::string path = program_folder_ + ":" + system_;
    const auto map_of = [](const ProgramResult& result) {
        EXPECT_EQ(result.exit_code, 0) << result.err;
        auto report = nlohmann::json::parse(result.out);
        std::erase_if(report.get_ref<nlohmann::json::object_t&>(),
                      [](const auto& value) { return value.first.starts_with("build_"); });
        return report;
    };
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"info", "--json", "-"}, {"info", folder_.file("map.tif"), "--json", "-"}}) {
        const auto safe = map_of(run(path, arguments, folder_.path()));
        EXPECT_EQ(map_of(run_among_enemies(path, arguments)), safe);
    }
    std::map<std::string, std::string> pictures;
    for (const char* name : {"safe.exr", "hostile.exr"}) {
        const std::vector<std::string> arguments = {"render", folder_.file("map.tif"), "-n", "16", "--size", "9",
                                                    "-o",     folder_.file(name),      "-q"};
        const bool safe = std::string(name) == "safe.exr";
        EXPECT_EQ((safe ? run(path, arguments, folder_.path()) : run_among_enemies(path, arguments)).exit_code, 0);
        const ProgramResult compared =
            run_program({"compare", folder_.file(name), folder_.file("safe.exr"), "--max-rel-rmse", "0"});
        EXPECT_EQ(compared.exit_code, 0) << compared.err;
    }
}

TEST_F(HostileFolder, AProgramWithoutItsModuleTakesNoOther) {
    const std::string path = lonely_copy() + ":" + system_;
    const ProgramResult tiff = run_among_enemies(path, {"info", folder_.file("map.tif")});
    EXPECT_EQ(tiff.exit_code, 3) << tiff.err;
    EXPECT_THAT(tiff.err, HasSubstr("clerestory_oiio.so"));
    const ProgramResult bundled = run_among_enemies(path, {"info"});
    EXPECT_EQ(bundled.exit_code, 3) << bundled.out;
    const ProgramResult exr = run_among_enemies(path, {"info", folder_.file("map.exr")});
    EXPECT_EQ(exr.exit_code, 0) << exr.err;
    EXPECT_THAT(exr.out, HasSubstr("8 x 4"));
}

/// A copy in a folder that everybody may put something into, as /tmp is.
TEST_F(HostileFolder, AModuleThatOthersCouldHavePutBesideTheProgramIsNotLoaded) {
    const fs::path folder = lonely_copy();
    const fs::path module = folder / "clerestory_oiio.so";
    fs::copy_file(CLERESTORY_HOSTILE_MODULE, module);
    const auto expect_refusal = [&](const std::string& why) {
        const ProgramResult tiff = run(folder.string() + ":" + system_, {"info", folder_.file("map.tif")}, folder);
        EXPECT_EQ(tiff.exit_code, 3) << tiff.err;
        EXPECT_THAT(tiff.err, HasSubstr(why));
        EXPECT_FALSE(fs::exists(proof_)) << why;
    };
    fs::permissions(module, fs::perms(0666));
    expect_refusal("others can write to it");
    if (!OtherUser::is_at_hand()) return;
    fs::permissions(module, fs::perms(0644));
    fs::permissions(folder, fs::perms(01777));
    OtherUser::give(module);
    expect_refusal("it belongs to user 65534");
}

TEST_F(HostileFolder, GnuplotIsThatOfPathsAbsoluteFolders) {
    const std::string plot = folder_.file("plot.svg");
    const std::vector<std::string> arguments = {"fresnel", "-o", plot, "-q"};
    ASSERT_EQ(run(program_folder_ + ":" + system_, arguments, folder_.path()).exit_code, 0);
    const std::string safe = read_file(plot);
    // Empty entries mean the current folder, as "." does.
    const std::string path = ":.:..:" + program_folder_ + "::" + system_;
    const std::map<std::string, std::string> settings = {{"GNUTERM", "x11"},
                                                         {"GNUPLOT_LIB", hostile_},
                                                         {"GNUPLOT_DRIVER_DIR", hostile_},
                                                         {"HOME", hostile_},
                                                         {"LC_ALL", "de_DE.UTF-8"}};
    const ProgramResult result = run_among_enemies(path, arguments, settings);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(read_file(plot), safe);
    const ProgramResult without = run(".:" + program_folder_, arguments, hostile_);
    EXPECT_EQ(without.exit_code, 5) << "gnuplot stands in the current folder alone";
    EXPECT_THAT(without.err, HasSubstr("gnuplot is not installed"));
    EXPECT_FALSE(fs::exists(proof_));
}

TEST_F(HostileFolder, ACacheOfTheCurrentFolderIsNone) {
    for (const char* variable : {"CLERESTORY_CACHE_DIR", "XDG_CACHE_HOME", "HOME"}) {
        std::vector<std::string> words = {"env",
                                          "-u",
                                          "CLERESTORY_CACHE_DIR",
                                          "-u",
                                          "XDG_CACHE_HOME",
                                          std::string(variable) + "=.",
                                          CLERESTORY_PROGRAM,
                                          "info",
                                          folder_.file("map.exr")};
        const auto before = names_in(hostile_);
        const ProgramResult result =
            run_command(words, {.environment = {{"POCL_CACHE_DIR", folder_.file("pocl")}}, .folder = hostile_});
        EXPECT_EQ(result.exit_code, 0) << result.err;
        EXPECT_EQ(names_in(hostile_), before) << variable;
    }
}

}  // namespace
}  // namespace clerestory::test
