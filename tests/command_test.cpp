// The program from outside: every exit code, what it says, and that it leaves nothing behind.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "image.hpp"
#include "run_program.hpp"
#include "test_device.hpp"

namespace clerestory::test {
namespace {

using nlohmann::json;

/// A small colourful PFM with rows from bottom to top, as the format has them.
void write_pfm(const std::string& file, int width, int height, float value) {
    std::ofstream out(file, std::ios::binary);
    out << "PF\n" << width << " " << height << "\n-1.0\n";
    for (int i = 0; i < width * height; ++i) {
        const float texel[3] = {value, value * static_cast<float>(i % 7), value / 2};
        out.write(reinterpret_cast<const char*>(texel), sizeof texel);
    }
}

std::size_t lines_of(const std::string& text) {
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

class Command : public ::testing::Test {
  protected:
    Command() { write_pfm(map_, 16, 8, 1); }

    /// Fails with `code`, in one line that holds `words`, and leaves the folder as it was.
    void expect_failure(const std::vector<std::string>& arguments, int code, const std::string& words) {
        const auto before = names_in(folder_.path());
        const ProgramResult result = run_program(arguments);
        EXPECT_EQ(result.exit_code, code) << result.err;
        EXPECT_NE(result.err.find(words), std::string::npos) << result.err;
        EXPECT_EQ(lines_of(result.err), 1U) << result.err;
        EXPECT_EQ(names_in(folder_.path()), before);
    }

    TempFolder folder_;
    std::string map_ = folder_.file("map.pfm");
};

TEST_F(Command, EveryCommandHasHelpWithAnExample) {
    for (const std::string name : {"fresnel", "info", "sample", "render", "compare", "devices", "batch", "merge"}) {
        const ProgramResult result = run_program({name, "--help"});
        EXPECT_EQ(result.exit_code, 0) << name;
        EXPECT_NE(result.out.find("Example:"), std::string::npos) << name;
    }
}

TEST_F(Command, RenderWritesAPictureWithItsParameters) {
    const std::string exr = folder_.file("sphere.exr");
    const ProgramResult result = run_program({"render", map_, "-n", "16", "--size", "33", "--seed", "5", "-o", exr,
                                              "-o", folder_.file("sphere.png"), "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json report = json::parse(result.out);
    EXPECT_EQ(report["samples"], 16);
    EXPECT_EQ(report["outputs"].size(), 2U);
    EXPECT_GT(report["seconds"]["total"].get<double>(), 0);
    const Header header = read_exr_header(exr);
    EXPECT_EQ(header.at("clerestory:samples").number, 16);
    EXPECT_EQ(header.at("clerestory:estimator").text, "shared");
    EXPECT_EQ(header.at("clerestory:seed").number, 5);
    EXPECT_FALSE(header.at("clerestory:device").text.empty());
    const Picture picture = read_picture(exr);
    EXPECT_EQ(picture.width, 33U);
    EXPECT_EQ(picture.alpha.at(0), 0);
    EXPECT_EQ(picture.alpha.at(16 * 33 + 16), 1);
}

TEST_F(Command, SeveralCountsGiveAPictureEach) {
    const ProgramResult result = run_program({"render", map_, "-n", "4,8", "--size", "9", "-o", folder_.file("s.exr"),
                                              "-o", folder_.file("p_{samples}.png")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(names_in(folder_.path()),
              (std::vector<std::string>{"map.pfm", "p_4.png", "p_8.png", "s_4.exr", "s_8.exr"}));
}

TEST_F(Command, TheSameSeedGivesTheSameFiles) {
    for (const std::string name : {"a.exr", "b.exr", "c.exr"}) {
        std::vector<std::string> arguments = {"render", map_, "-n", "64", "--size", "33", "-o", folder_.file(name)};
        if (name == "b.exr")
            arguments.insert(arguments.end(), {"--threads", std::to_string(threads_where_possible(1))});
        if (name == "c.exr") arguments.insert(arguments.end(), {"--work-group", "3"});
        ASSERT_EQ(run_program(arguments).exit_code, 0);
    }
    const Picture a = read_picture(folder_.file("a.exr"));
    EXPECT_EQ(a.rgb, read_picture(folder_.file("b.exr")).rgb);
    EXPECT_EQ(a.rgb, read_picture(folder_.file("c.exr")).rgb);
}

TEST_F(Command, SampleWritesRecordsThatAgreeWithThemselves) {
    const ProgramResult result =
        run_program({"sample", map_, "-n", "64,256", "-o", folder_.file("marks"), "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(names_in(folder_.path() / "marks"),
              (std::vector<std::string>{"samples_256.csv", "samples_256.png", "samples_64.csv", "samples_64.png"}));
    std::istringstream csv(read_file(folder_.path() / "marks" / "samples_64.csv"));
    std::string line;
    std::getline(csv, line);
    EXPECT_EQ(line, "index,row,column,theta,phi,x,y,z,pdf,r,g,b");
    std::size_t count = 0;
    while (std::getline(csv, line)) {
        std::vector<double> v;
        std::istringstream fields(line);
        for (std::string field; std::getline(fields, field, ',');) v.push_back(std::stod(field));
        ASSERT_EQ(v.size(), 12U);
        EXPECT_EQ(v[0], static_cast<double>(count));
        EXPECT_NEAR(v[5], std::sin(v[3]) * std::cos(v[4]), 1e-6);
        EXPECT_NEAR(v[6], std::cos(v[3]), 1e-6);
        EXPECT_NEAR(v[7], std::sin(v[3]) * std::sin(v[4]), 1e-6);
        EXPECT_EQ(std::floor(v[4] / (2 * M_PI) * 16), v[2]);
        EXPECT_EQ(std::floor(v[3] / M_PI * 8), v[1]);
        EXPECT_GT(v[8], 0);
        ++count;
    }
    EXPECT_EQ(count, 64U);
}

TEST_F(Command, CompareEndsWithOneWhereTheErrorIsTooLarge) {
    const std::string a = folder_.file("a.exr");
    const std::string b = folder_.file("b.exr");
    ASSERT_EQ(run_program({"render", map_, "-n", "4", "--size", "33", "-o", a, "-q"}).exit_code, 0);
    ASSERT_EQ(run_program({"render", map_, "--estimator", "exact", "--size", "33", "-o", b, "-q"}).exit_code, 0);
    const ProgramResult result = run_program({"compare", a, b, "--json", "-"});
    EXPECT_EQ(result.exit_code, 0);
    const json report = json::parse(result.out);
    for (const std::string key : {"rmse", "rel_rmse", "bias", "max_abs", "psnr"}) EXPECT_TRUE(report.contains(key));
    EXPECT_GT(report["rel_rmse"].get<double>(), 0);
    const ProgramResult failed = run_program({"compare", a, b, "--max-rel-rmse", "0.000001"});
    EXPECT_EQ(failed.exit_code, 1);
    EXPECT_EQ(run_program({"compare", b, b, "--max-rel-rmse", "0"}).exit_code, 0);
}

TEST_F(Command, UsageErrorsEndWithTwo) {
    EXPECT_EQ(run_program({}).exit_code, 2);
    EXPECT_EQ(run_program({"paint"}).exit_code, 2);
    EXPECT_EQ(run_program({"render", "--no-such-flag"}).exit_code, 2);
    EXPECT_EQ(run_program({"render", map_, "-n", "0"}).exit_code, 2);
    EXPECT_EQ(run_program({"render", map_, "--rotate-y", "nan"}).exit_code, 2);
    EXPECT_EQ(run_program({"render", map_, "--scale", "inf"}).exit_code, 2);
    EXPECT_EQ(run_program({"render", map_, "--gamma", "0"}).exit_code, 2);
    expect_failure({"render", map_, "-o", folder_.file("x.jpg")}, 2, ".exr or .png");
    expect_failure({"render", map_, "-o", folder_.file("x.png"), "-o", folder_.file("x.png")}, 2, "two results");
    expect_failure({"render", map_, "--json", "-", "--device", "first"}, 2, "--device");
}

TEST_F(Command, BadInputEndsWithThree) {
    std::ofstream(folder_.file("text.exr")) << "this is no picture\n";
    const std::string out = folder_.file("x.exr");
    expect_failure({"render", folder_.file("missing.exr"), "-o", out}, 3, "missing.exr");
    expect_failure({"render", folder_.file("text.exr"), "-o", out}, 3, "text.exr");
    expect_failure({"render", folder_.path().string(), "-o", out}, 3, folder_.path().string());
    for (const float bad : {NAN, INFINITY, -1.0F}) {
        write_pfm(folder_.file("bad.pfm"), 4, 2, bad);
        expect_failure({"render", folder_.file("bad.pfm"), "-o", out}, 3, "first at row 0, column 0");
        const ProgramResult repaired =
            run_program({"render", folder_.file("bad.pfm"), "--bad-texels", "zero", "--size", "9", "-o", out});
        EXPECT_EQ(repaired.exit_code, 0);
        EXPECT_NE(repaired.err.find("warning"), std::string::npos);
        std::filesystem::remove(out);
    }
}

TEST_F(Command, ABlackMapRendersBlackButCannotBeSampled) {
    write_pfm(folder_.file("black.pfm"), 4, 2, 0);
    const ProgramResult render =
        run_program({"render", folder_.file("black.pfm"), "--size", "9", "-o", folder_.file("b.exr")});
    EXPECT_EQ(render.exit_code, 0);
    EXPECT_NE(render.err.find("the map is black"), std::string::npos);
    const ProgramResult sample = run_program({"sample", folder_.file("black.pfm"), "-o", folder_.file("marks")});
    EXPECT_EQ(sample.exit_code, 3);
    EXPECT_FALSE(std::filesystem::exists(folder_.file("marks")));
}

TEST_F(Command, AnUnknownDeviceEndsWithFour) {
    expect_failure({"render", map_, "--device", "9:9", "-o", folder_.file("x.exr")}, 4, "no OpenCL device 9:9");
}

TEST_F(Command, OutputThatCannotBeWrittenEndsWithFive) {
    // A file where a folder should be stands for an unwritable folder: permissions do not bind root.
    expect_failure({"render", map_, "--size", "9", "-q", "-o", map_ + "/x.exr"}, 5, map_);
    expect_failure({"sample", map_, "-n", "4", "-q", "-o", map_}, 5, map_);
    // A full disk.
    expect_failure({"render", map_, "--size", "9", "-q", "--json", "/dev/full"}, 5, "/dev/full");
}

TEST_F(Command, InfoTellsWhatAMapHolds) {
    const ProgramResult result = run_program({"info", map_, "--json", "-"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const json report = json::parse(result.out);
    EXPECT_EQ(report["width"], 16);
    EXPECT_EQ(report["height"], 8);
    for (const std::string key :
         {"phi", "max_intensity", "nan", "inf", "negative", "zero", "undrawable_f32", "build_seconds"}) {
        EXPECT_TRUE(report[key].is_number()) << key;
    }
    write_pfm(folder_.file("bad.pfm"), 4, 2, NAN);
    const ProgramResult bad = run_program({"info", folder_.file("bad.pfm"), "--json", "-"});
    EXPECT_EQ(bad.exit_code, 3);
    EXPECT_EQ(json::parse(bad.out)["nan"], 8);
}

TEST_F(Command, WithoutAMapTheBundledOneIsUsed) {
    const ProgramResult result = run_program({"info", "--json", "-"}, {.environment = {}, .folder = folder_.path()});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(json::parse(result.out)["width"], 1024);
}

}  // namespace
}  // namespace clerestory::test
