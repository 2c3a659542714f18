#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "run_program.hpp"
#include "svg_plot.hpp"

namespace clerestory::test {
namespace {

using nlohmann::json;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int USAGE = 2;
constexpr int OUTPUT = 5;
const std::vector<std::string> CURVES = {"parallel", "perpendicular", "mean", "Schlick"};
const std::vector<std::string> KEYS = {"r_parallel", "r_perpendicular", "r_mean", "r_schlick"};

std::vector<std::string> fresnel(const std::string& incident, const std::string& transmitted,
                                 const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"fresnel", "--ior-incident", incident, "--ior-transmitted", transmitted};
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

json report(const std::string& incident, const std::string& transmitted, const std::vector<std::string>& more = {}) {
    auto words = fresnel(incident, transmitted, {"--json", "-"});
    words.insert(words.end(), more.begin(), more.end());
    const auto result = run_program(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out);
}

TEST(FresnelCommand, GlassHasItsKnownNumbersFromBothSides) {
    constexpr double PRINTED = 5e-6;  // known to five decimals
    const auto in = report("1", "1.5");
    EXPECT_DOUBLE_EQ(in["r0"], 0.04);
    EXPECT_NEAR(in["brewster_deg"], 56.30993, PRINTED);
    EXPECT_TRUE(in["critical_deg"].is_null());
    EXPECT_NEAR(in["schlick_max_rel_error"], 0.232, 5e-4);
    EXPECT_NEAR(in["schlick_max_rel_error_deg"], 55.5, 0.05);
    const auto out = report("1.5", "1");
    EXPECT_DOUBLE_EQ(out["r0"], 0.04);
    EXPECT_NEAR(out["critical_deg"], 41.81031, PRINTED);
    EXPECT_NEAR(out["brewster_deg"], 33.69007, PRINTED);
    // Light takes the same way back, so Schlick is as wrong from inside.
    EXPECT_NEAR(out["schlick_max_rel_error"], in["schlick_max_rel_error"], 1e-12);
}

TEST(FresnelCommand, EveryPointOfThePlottedCurvesIsInTheJson) {
    const TempFolder folder;
    for (const auto& [incident, transmitted] : {std::pair("1", "1.5"), std::pair("1.5", "1")}) {
        const auto numbers = report(incident, transmitted, {"-o", folder.file("f.svg")});
        const auto drawn = read_svg_plot(read_file(folder.path() / "f.svg"));
        for (std::size_t c = 0; c < CURVES.size(); ++c) {
            const auto& points = drawn.curve(CURVES[c]).points;
            ASSERT_EQ(points.size(), numbers["angle_deg"].size()) << CURVES[c];
            for (std::size_t i = 0; i < points.size(); ++i) {
                EXPECT_NEAR(points[i].x, numbers["angle_deg"][i], drawn.x_resolution()) << CURVES[c] << i;
                EXPECT_NEAR(points[i].y, numbers[KEYS[c]][i], drawn.y_resolution()) << CURVES[c] << i;
            }
        }
    }
}

TEST(FresnelCommand, AnglesOfInterestAreMarkedAndLabelled) {
    const TempFolder folder;
    const auto numbers = report("1.5", "1", {"-o", folder.file("f.svg")});
    const auto drawn = read_svg_plot(read_file(folder.path() / "f.svg"));
    ASSERT_EQ(drawn.vertical_marks.size(), 2U);
    EXPECT_NEAR(drawn.vertical_marks[0], numbers["brewster_deg"], drawn.x_resolution());
    EXPECT_NEAR(drawn.vertical_marks[1], numbers["critical_deg"], drawn.x_resolution());
    EXPECT_THAT(drawn.texts, Contains("Brewster's angle 33.69°"));
    EXPECT_THAT(drawn.texts, Contains("critical angle 41.81°"));
    EXPECT_THAT(drawn.texts, Contains("angle of incidence [degrees]"));
}

TEST(FresnelCommand, CsvHoldsTheNumbersOfTheJson) {
    const TempFolder folder;
    const auto numbers =
        report("1", "2.42", {"-o", folder.file("f.csv"), "-o", folder.file("f.json"), "--steps", "91"});
    EXPECT_EQ(json::parse(read_file(folder.path() / "f.json")), numbers);
    std::istringstream lines(read_file(folder.path() / "f.csv"));
    std::string line;
    std::getline(lines, line);
    EXPECT_EQ(line, "angle_deg,r_parallel,r_perpendicular,r_mean,r_schlick");
    std::size_t row = 0;
    for (; std::getline(lines, line); ++row) {
        std::replace(line.begin(), line.end(), ',', ' ');
        std::istringstream cells(line);
        double cell = 0;
        cells >> cell;
        EXPECT_EQ(cell, numbers["angle_deg"][row]);
        for (const auto& key : KEYS) {
            cells >> cell;
            EXPECT_EQ(cell, numbers[key][row]) << key << row;
        }
    }
    EXPECT_EQ(row, 91U);
}

TEST(FresnelCommand, SchlicksWorstErrorsBoundTheCurves) {
    const auto numbers = report("1", "1.5");
    double worst_abs = 0;
    double worst_rel = 0;
    for (std::size_t i = 0; i < numbers["angle_deg"].size(); ++i) {
        const double mean = numbers["r_mean"][i];
        const double error = std::abs(numbers["r_schlick"][i].get<double>() - mean);
        worst_abs = std::max(worst_abs, error);
        worst_rel = std::max(worst_rel, error / mean);
    }
    // Floats round the curves by 6e-8 of at most 1; between tenths of a degree the error changes by less than 1e-5.
    constexpr double ROUNDING = 2e-6;
    constexpr double GRID = 1e-5;
    EXPECT_LE(worst_abs, numbers["schlick_max_abs_error"].get<double>() + ROUNDING);
    EXPECT_LE(worst_rel, numbers["schlick_max_rel_error"].get<double>() + ROUNDING);
    EXPECT_NEAR(worst_abs, numbers["schlick_max_abs_error"], GRID);
    EXPECT_NEAR(worst_rel, numbers["schlick_max_rel_error"], GRID);
}

TEST(FresnelCommand, ChosenAnglesReplaceTheGrid) {
    const auto numbers = report("1", "1.5", {"--angles", "56.30993247402021,0,90"});
    EXPECT_THAT(numbers["angle_deg"], ElementsAre(0.0, 56.30993247402021, 90.0));
    EXPECT_THAT(numbers["r_perpendicular"].back(), 1.0);
    EXPECT_LT(numbers["r_parallel"][1], 1e-30);
}

TEST(FresnelCommand, EqualMediaHaveNullWhereThereIsNoNumber) {
    const auto numbers = report("1.5", "1.5", {"--steps", "3"});
    EXPECT_THAT(numbers["r_mean"], ElementsAre(0.0, 0.0, 1.0));
    EXPECT_TRUE(numbers["critical_deg"].is_null());
    EXPECT_TRUE(numbers["schlick_max_rel_error"].is_null());
}

TEST(FresnelCommand, ImpossibleInputIsAUsageErrorOfOneLineAndWritesNothing) {
    const TempFolder folder;
    const std::vector<std::vector<std::string>> bad = {
        fresnel("0", "1.5"),
        fresnel("-1", "1.5"),
        fresnel("1", "nan"),
        fresnel("inf", "1.5"),
        fresnel("1", "1e300"),
        fresnel("1", "1.5", {"--steps", "1"}),
        fresnel("1", "1.5", {"--steps", "0"}),
        fresnel("1", "1.5", {"--steps", "4000000000"}),
        fresnel("1", "1.5", {"--angles", "91"}),
        fresnel("1", "1.5", {"--angles", "nan"}),
        fresnel("1", "1.5", {"-o", folder.file("f.pdf")}),
        fresnel("1", "1.5", {"-o", folder.file("nosuffix")}),
    };
    for (auto words : bad) {
        words.insert(words.end(), {"-o", folder.file("f.csv")});
        const auto result = run_program(words);
        const auto line = testing::PrintToString(words);
        EXPECT_EQ(result.exit_code, USAGE) << line;
        EXPECT_THAT(result.out, IsEmpty()) << line;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        EXPECT_THAT(result.err, HasSubstr("clerestory: ")) << line;
    }
    for (const char* steps : {"-5", "many", "1e40", "2.5"}) {
        EXPECT_EQ(run_program(fresnel("1", "1.5", {"--steps", steps})).exit_code, USAGE) << steps;
    }
    EXPECT_THAT(names_in(folder.path()), IsEmpty());
}

TEST(FresnelCommand, MissingGnuplotIsSaidAndLeavesNothing) {
    const TempFolder folder;
    for (const char* suffix : {"svg", "png"}) {
        const auto result = run_program(fresnel("1", "1.5", {"-o", folder.file(std::string("f.") + suffix)}),
                                        {{{"PATH", folder.path().string()}}, {}});
        EXPECT_EQ(result.exit_code, OUTPUT);
        EXPECT_THAT(result.err, HasSubstr("install gnuplot-nox"));
    }
    EXPECT_THAT(names_in(folder.path()), IsEmpty());
}

TEST(FresnelCommand, AFolderThatCannotBeMadeIsAnOutputError) {
    const auto result = run_program(fresnel("1", "1.5", {"-o", "/dev/null/f.csv"}));
    EXPECT_EQ(result.exit_code, OUTPUT);
    EXPECT_THAT(result.err, HasSubstr("/dev/null"));
}

}  // namespace
}  // namespace clerestory::test
