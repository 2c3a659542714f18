// What of a file lights, from the command line: flags, job files, what reports and headers say, exported scenes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "image.hpp"
#include "image_files.hpp"
#include "run_program.hpp"

namespace clerestory::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// 8 x 4, lit from one side, each channel in its own way.
std::vector<float> light() {
    std::vector<float> rgb;
    for (int t = 0; t < 32; ++t) rgb.insert(rgb.end(), {1.0F + static_cast<float>(t), 0.25F, t == 5 ? 40.0F : 0.5F});
    return rgb;
}

std::vector<ExrChannel> channels(const std::vector<float>& rgb, const std::string& prefix = "",
                                 const std::string& letters = "RGB") {
    std::vector<ExrChannel> out;
    for (std::size_t c = 0; c < 3; ++c) out.push_back({prefix + letters[c], Imf::FLOAT, channel(rgb, c)});
    return out;
}

class MapSources : public testing::Test {
  protected:
    MapSources() {
        write_test_exr(file("plain.exr"), {8, 4}, channels(light()));
        write_test_exr(file("lower.exr"), {8, 4}, channels(light(), "", "rgb"));
        std::vector<ExrChannel> all = channels(std::vector<float>(96, 1.0F), "View.AO.");
        for (const auto& c : channels(light(), "View.Combined.")) all.push_back(c);
        for (const auto& c : channels(std::vector<float>(96, 7.0F), "View.Normal.", "XYZ")) all.push_back(c);
        write_test_exr(file("layers.exr"), {8, 4}, all);
        write_exr_parts(file("parts.exr"), {8, 4},
                        {{"depth", {{"Z", Imf::FLOAT, std::vector<float>(32, 9.0F)}}},
                         {"rgb", channels(light())},
                         {"ambient", channels(std::vector<float>(96, 1.0F))}});
    }

    std::string file(const std::string& name) const { return folder_.file(name); }

    ProgramResult run(std::vector<std::string> words) const { return run_program(words, {.folder = folder_.path()}); }

    nlohmann::json info(const std::string& name, std::vector<std::string> more = {}) const {
        std::vector<std::string> words = {"info", name, "--json", "-"};
        words.insert(words.end(), more.begin(), more.end());
        const ProgramResult result = run(words);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return nlohmann::json::parse(result.out);
    }

    std::vector<float> sphere(const std::string& name, std::vector<std::string> more = {}) const {
        std::vector<std::string> words = {"render", name, "--size", "9", "-n", "64", "-o", "sphere.exr", "-q"};
        words.insert(words.end(), more.begin(), more.end());
        const ProgramResult result = run(words);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return read_picture(file("sphere.exr")).rgb;
    }

    TempFolder folder_;
};

TEST_F(MapSources, TheSameLightWhateverItsNames) {
    const std::vector<float> expected = sphere("plain.exr");
    for (const char* name : {"lower.exr", "layers.exr", "parts.exr"}) EXPECT_EQ(sphere(name), expected) << name;
    EXPECT_NE(sphere("layers.exr", {"--layer", "ao"}), expected);
    EXPECT_EQ(sphere("layers.exr", {"--layer", "Combined", "--part", "0"}), expected);
    EXPECT_NE(sphere("parts.exr", {"--part", "002"}), expected);
    EXPECT_EQ(sphere("parts.exr", {"--layer", "rgb"}), expected);
}

TEST_F(MapSources, ReportsAndHeadersSayWhatLit) {
    const nlohmann::json report = info("layers.exr");
    EXPECT_EQ(report["source"]["format"], "OpenEXR");
    EXPECT_EQ(report["source"]["compression"], "zip");
    EXPECT_EQ(report["source"]["type"], "float");
    EXPECT_EQ(report["source"]["part"], 0);
    EXPECT_EQ(report["source"]["layer"], "View.Combined");
    EXPECT_EQ(report["source"]["channels"],
              (std::vector<std::string>{"View.Combined.R", "View.Combined.G", "View.Combined.B"}));
    EXPECT_EQ(info("parts.exr")["source"]["part"], 1);
    EXPECT_THAT(run({"info", "layers.exr"}).out,
                HasSubstr("lit by           View.Combined.R, View.Combined.G, View.Combined.B of layer View.Combined, "
                          "part 0 of OpenEXR, float, compression zip"));
    sphere("layers.exr", {"--layer", "AO"});
    const Header header = read_exr_header(file("sphere.exr"));
    EXPECT_EQ(header.at("clerestory:source:layer").text, "View.AO");
    EXPECT_EQ(header.at("clerestory:source:part").number, 0);
    EXPECT_EQ(header.at("clerestory:source:channels").text, "View.AO.R,View.AO.G,View.AO.B");
    EXPECT_EQ(header.at("clerestory:asked_layer").text, "AO");
}

TEST_F(MapSources, WhatCannotLightIsExitThreeNamingTheLayers) {
    std::vector<ExrChannel> two = channels(light(), "a.");
    for (const auto& c : channels(light(), "b.")) two.push_back(c);
    write_test_exr(file("two.exr"), {8, 4}, two);
    for (const char* command : {"info", "render", "sample"}) {
        std::vector<std::string> words = {command, "two.exr"};
        if (std::string(command) == "render") words.insert(words.end(), {"-o", "x.exr"});
        const ProgramResult result = run(words);
        EXPECT_EQ(result.exit_code, 3) << command;
        EXPECT_EQ(result.err, "clerestory: two.exr: several layers could light (a, b); choose one with --layer NAME\n");
    }
    EXPECT_EQ(run({"compare", "two.exr", "plain.exr"}).exit_code, 3);
    EXPECT_EQ(run({"info", "plain.exr", "--part", "1"}).exit_code, 3);
    EXPECT_EQ(run({"info", "plain.exr", "--part", "-1"}).exit_code, 2);
    EXPECT_EQ(run({"info", "plain.exr", "--layer", ""}).exit_code, 2);
}

TEST_F(MapSources, ComparedPicturesAreReadByTheSameRules) {
    const auto difference = [&](const std::vector<std::string>& words) {
        std::vector<std::string> all = {"compare", "--json", "-"};
        all.insert(all.end(), words.begin(), words.end());
        const ProgramResult result = run(all);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        return nlohmann::json::parse(result.out)["rmse"].get<double>();
    };
    EXPECT_EQ(difference({"lower.exr", "plain.exr"}), 0);
    EXPECT_EQ(difference({"layers.exr", "parts.exr"}), 0);
    EXPECT_GT(difference({"layers.exr", "parts.exr", "--layer", "AO"}), 0);
    EXPECT_EQ(difference({"layers.exr", "parts.exr", "--layer", "AO", "--reference-layer", "ambient"}), 0);
    EXPECT_EQ(difference({"parts.exr", "parts.exr", "--part", "2", "--reference-part", "2"}), 0);
}

TEST_F(MapSources, AJobFileChoosesToo) {
    std::ofstream(file("jobs.toml")) << "[[job]]\nmap = \"layers.exr\"\nlayer = \"AO\"\nsize = 9\nsamples = 64\n"
                                        "output = \"ao.exr\"\n"
                                        "[[job]]\nmap = \"parts.exr\"\npart = 2\nsize = 9\nsamples = 64\n"
                                        "output = \"ambient.exr\"\n"
                                        "[[job]]\nmap = \"parts.exr\"\nsize = 9\nsamples = 64\noutput = \"rgb.exr\"\n";
    const ProgramResult result = run({"batch", "jobs.toml"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(read_picture(file("rgb.exr")).rgb, sphere("plain.exr"));
    EXPECT_EQ(read_picture(file("ao.exr")).rgb, sphere("layers.exr", {"--layer", "AO"}));
    EXPECT_EQ(read_picture(file("ambient.exr")).rgb, read_picture(file("ao.exr")).rgb);
}

std::size_t count(const std::string& text, const std::string& what) {
    std::size_t found = 0;
    for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
    return found;
}

TEST_F(MapSources, WhatIsOddOfAMapIsSaidOnceOnStderr) {
    ExrLayout layout{.width = 8, .height = 2, .origin_x = 0, .origin_y = 2};
    layout.edit = [](Imf::Header& header) { header.displayWindow() = Imath::Box2i({0, 0}, {7, 3}); };
    const std::vector<float> rgb(48, 1.0F);
    write_test_exr(file("crop.exr"), layout, channels(rgb));
    const std::string cropped =
        "warning: crop.exr: holds 8 x 2 at (0, 2) of a picture of 8 x 4 at (0, 0); the rest is "
        "black\n";
    const ProgramResult several =
        run({"render", "crop.exr", "-n", "1,2,4", "--size", "5", "-o", "x_{samples}.exr", "-q"});
    EXPECT_EQ(several.exit_code, 0);
    EXPECT_EQ(several.err, cropped);
    EXPECT_THAT(run({"info", "crop.exr"}).err, cropped);
    EXPECT_THAT(run({"compare", "crop.exr", "plain.exr"}).err, cropped);
    std::ofstream(file("jobs.toml")) << "[[job]]\nmap = \"crop.exr\"\nsize = 5\nsamples = 4\nrotate_y = [0, 90, 180]\n"
                                        "output = \"{map}_{rotation}.exr\"\n"
                                        "[[job]]\nmap = \"crop.exr\"\nflip_y = true\nsize = 5\nsamples = 4\n"
                                        "output = \"{map}_flipped.exr\"\n";
    const ProgramResult batch = run({"batch", "jobs.toml", "-q"});
    EXPECT_EQ(batch.exit_code, 0);
    EXPECT_EQ(count(batch.err, "holds 8 x 2"), 1U) << batch.err;
}

// --- scenes

class MapScenes : public MapSources {
  protected:
    /// The map that the exported scene names.
    std::string named(const std::string& map, std::vector<std::string> more = {}) {
        std::vector<std::string> words = {"render", map,        "--size",       "5", "-n", "4", "-o",
                                          "s.exr",  "--export", "mitsuba,pbrt", "-q"};
        words.insert(words.end(), more.begin(), more.end());
        const ProgramResult result = run(words);
        EXPECT_EQ(result.exit_code, 0) << result.err;
        const std::string xml = read_file(file("s.xml"));
        const std::string lead = "<string name=\"filename\" value=\"";
        const std::size_t begin = xml.find(lead) + lead.size();
        const std::string name = xml.substr(begin, xml.find('"', begin) - begin);
        EXPECT_THAT(read_file(file("s.pbrt")), HasSubstr("_equiarea.exr " + name + "\n"));
        flipped_ = xml.find("0 0 -1 0 0 -1 0 0") != std::string::npos;
        return name;
    }
    bool flipped_ = false;
};

TEST_F(MapScenes, NameAFileThatAnyRendererReadsAlike) {
    EXPECT_EQ(named("plain.exr"), file("plain.exr"));
    EXPECT_EQ(named("plain.exr", {"--flip-y"}), file("plain.exr"));
    EXPECT_TRUE(flipped_);
    EXPECT_THAT(names_in(folder_.path()), Not(testing::Contains("s_map.exr")));

    std::vector<float> broken = light();
    broken[0] = std::numeric_limits<float>::quiet_NaN();
    write_test_exr(file("broken.exr"), {8, 4}, channels(broken));
    write_pfm(file("map.pfm"), 8, 4, light());
    const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
        {"layers.exr", {}}, {"parts.exr", {}},         {"lower.exr", {}},
        {"map.pfm", {}},    {"map.pfm", {"--flip-y"}}, {"broken.exr", {"--bad-texels", "zero"}}};
    for (const auto& [map, flags] : cases) {
        EXPECT_EQ(named(map, flags), file("s_map.exr")) << map;
        EXPECT_FALSE(flipped_) << "the copy is upright";
        const RadianceMap copy = read_map(file("s_map.exr"));
        EXPECT_TRUE(copy.source.plain);
        std::vector<float> expected = light();
        if (map == "broken.exr") std::fill_n(expected.begin(), 3, 0.0F);
        if (!flags.empty() && flags[0] == "--flip-y") {
            for (std::size_t row = 0; row < 2; ++row) {
                std::swap_ranges(&expected[24 * row], &expected[24 * row] + 24, &expected[24 * (3 - row)]);
            }
        }
        EXPECT_EQ(std::vector<float>(copy.rgb.data(), copy.rgb.data() + copy.rgb.size()), expected) << map;
    }
}

TEST_F(MapScenes, TheCopyReplacesNoMap) {
    std::ofstream(file("s_map.exr"), std::ios::binary) << read_file(file("lower.exr"));
    const ProgramResult result =
        run({"render", "s_map.exr", "--size", "5", "-n", "4", "-o", "s.exr", "--export", "mitsuba"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("would replace s_map.exr"));
}

}  // namespace
}  // namespace clerestory::test
