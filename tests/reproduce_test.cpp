#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "base/statistics.hpp"
#include "base/text_escape.hpp"
#include "comparison.hpp"
#include "image.hpp"
#include "image_files.hpp"
#include "map/turned_map.hpp"
#include "maps.hpp"
#include "run_program.hpp"
#include "svg_plot.hpp"
#include "test_device.hpp"

namespace clerestory::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr int USAGE = 2;
constexpr int INPUT = 3;
constexpr int OUTPUT = 5;
constexpr int MAP_WIDTH = 64;
constexpr int MAP_HEIGHT = 32;

Picture read_png(const std::filesystem::path& file) {
    ReadOptions options;
    options.oiio_module = CLERESTORY_OIIO_MODULE;
    return read_picture(file, options);
}

const std::vector<std::string> SPHERES = {"figure_05", "figure_06a", "figure_06b",
                                          "figure_08", "figure_09",  "figure_10"};

/// A dim sky with one bright patch, so that samples crowd and the sphere is lit from all around.
std::vector<float> sky() {
    std::vector<float> rgb;
    for (int i = 0; i < MAP_HEIGHT; ++i) {
        for (int j = 0; j < MAP_WIDTH; ++j) {
            const bool sun = i >= 6 && i < 9 && j >= 20 && j < 24;
            rgb.insert(rgb.end(), {sun ? 8.0F : 0.25F, sun ? 6.0F : 0.25F + 0.005F * static_cast<float>(j), 0.5F});
        }
    }
    return rgb;
}

/// One run of the whole command on a small map, shared by the tests below.
class ReproduceRun : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        folder_ = std::make_unique<TempFolder>();
        write_pfm(folder_->path() / "sky.pfm", MAP_WIDTH, MAP_HEIGHT, sky());
        result_ = run_program({"reproduce", folder_->file("sky.pfm"), "--size", "64", "--seeds", "4", "--seed", "3",
                               "-o", folder_->file("out")});
        if (result_.exit_code == 0) report_ = json::parse(read_file(folder_->path() / "out" / "report.json"));
    }
    static void TearDownTestSuite() { folder_.reset(); }
    void SetUp() override { ASSERT_EQ(result_.exit_code, 0) << result_.err; }

    static std::filesystem::path out(const std::string& name) { return folder_->path() / "out" / name; }
    static const json& figure(const std::string& id) { return report_.at("figures").at(id); }
    static std::string page() { return read_file(out("index.html")); }

    static std::unique_ptr<TempFolder> folder_;
    static ProgramResult result_;
    static json report_;
};
std::unique_ptr<TempFolder> ReproduceRun::folder_;
ProgramResult ReproduceRun::result_;
json ReproduceRun::report_;

/// A command line as a shell would run it in `folder`, with this build's program.
int run_in_shell(const std::string& command, const std::filesystem::path& folder) {
    const std::string name = "clerestory ";
    EXPECT_EQ(command.rfind(name, 0), 0U) << command;
    std::string line = "cd " + shell_word(folder.string()) + " && " + shell_word(CLERESTORY_PROGRAM) + " " +
                       command.substr(name.size());
    for (const std::string& flag : test_flags()) line.append(" ").append(shell_word(flag));
    line += " >/dev/null 2>&1";
    return std::system(line.c_str());
}

std::vector<std::array<std::size_t, 2>> places_in_csv(const std::string& csv) {
    std::vector<std::array<std::size_t, 2>> places;
    std::istringstream lines(csv);
    std::string line;
    std::getline(lines, line);
    EXPECT_EQ(line, "index,row,column,theta,phi,x,y,z,pdf,r,g,b");
    while (std::getline(lines, line)) {
        std::array<std::size_t, 2> place{};
        std::size_t index = 0;
        EXPECT_EQ(std::sscanf(line.c_str(), "%zu,%zu,%zu", &index, &place[0], &place[1]), 3) << line;
        EXPECT_EQ(index, places.size());
        places.push_back(place);
    }
    return places;
}

TEST_F(ReproduceRun, WritesEveryFigureTheReportAndThePageAndNothingElse) {
    std::set<std::string> expected = {"report.json", "index.html"};
    for (const auto& [id, numbers] : report_.at("figures").items()) {
        expected.insert(numbers.at("file"));
        if (numbers.contains("csv")) expected.insert(numbers.at("csv"));
        if (numbers.contains("control")) expected.insert(numbers.at("control").at("file"));
    }
    for (const char* file :
         {"figure_01a.svg", "figure_01b.svg", "figure_02.png", "figure_03.png", "figure_04.png", "figure_05.png",
          "figure_06a.png", "figure_06b.png", "figure_07.png", "figure_08.png", "figure_09.png", "figure_10.png"}) {
        EXPECT_TRUE(expected.contains(file)) << file;
    }
    const auto names = names_in(folder_->path() / "out");
    EXPECT_EQ(std::set<std::string>(names.begin(), names.end()), expected);
}

TEST_F(ReproduceRun, MarksAreGreenSquaresOfFiveTexelsAroundEachSampleOfTheCsvAndNowhereElse) {
    for (const char* id : {"figure_02", "figure_03", "figure_04"}) {
        const auto places = places_in_csv(read_file(out(figure(id).at("csv"))));
        EXPECT_EQ(places.size(), figure(id).at("samples"));
        std::set<std::array<std::size_t, 2>> distinct(places.begin(), places.end());
        EXPECT_EQ(distinct.size(), figure(id).at("distinct_texels"));
        const Picture picture = read_png(out(figure(id).at("file")));
        ASSERT_EQ(picture.width, std::size_t{MAP_WIDTH});
        ASSERT_EQ(picture.height, std::size_t{MAP_HEIGHT});
        constexpr int REACH = 2;
        for (int row = 0; row < MAP_HEIGHT; ++row) {
            for (int column = 0; column < MAP_WIDTH; ++column) {
                const bool near = std::any_of(distinct.begin(), distinct.end(), [&](const auto& place) {
                    return std::abs(static_cast<int>(place[0]) - row) <= REACH &&
                           std::abs(static_cast<int>(place[1]) - column) <= REACH;
                });
                const float* rgb = &picture.rgb[3 * static_cast<std::size_t>(row * MAP_WIDTH + column)];
                EXPECT_EQ(rgb[0] == 0 && rgb[1] == 1 && rgb[2] == 0, near) << id << " " << row << " " << column;
            }
        }
    }
}

TEST_F(ReproduceRun, FresnelCurvesAreDrawnWhereTheReportHasThem) {
    const std::vector<std::pair<std::string, std::string>> curves = {
        {"parallel", "r_parallel"}, {"perpendicular", "r_perpendicular"}, {"mean", "r_mean"}, {"Schlick", "r_schlick"}};
    for (const char* id : {"figure_01a", "figure_01b"}) {
        const auto drawn = read_svg_plot(read_file(out(figure(id).at("file"))));
        for (const auto& [label, name] : curves) {
            const auto& points = drawn.curve(label).points;
            ASSERT_EQ(points.size(), figure(id).at("angle_deg").size());
            for (std::size_t i = 0; i < points.size(); ++i) {
                EXPECT_NEAR(points[i].x, figure(id).at("angle_deg")[i], drawn.x_resolution());
                EXPECT_NEAR(points[i].y, figure(id).at(name)[i], drawn.y_resolution());
            }
        }
    }
    EXPECT_NEAR(figure("figure_01a").at("brewster_deg"), std::atan(1.5) * 180 / M_PI, 1e-9);
    EXPECT_NEAR(figure("figure_01b").at("critical_deg"), std::asin(1 / 1.5) * 180 / M_PI, 1e-9);
}

TEST_F(ReproduceRun, FigureSevenIsTheMapRolledByAQuarterOfItsColumns) {
    const Picture shown = read_png(out("figure_07.png"));
    ASSERT_EQ(shown.width, std::size_t{MAP_WIDTH});
    const auto rgb = sky();
    const double exposure = report_.at("exposure");
    for (int i = 0; i < MAP_HEIGHT; ++i) {
        for (int j = 0; j < MAP_WIDTH; ++j) {
            const int from = (j + MAP_WIDTH - MAP_WIDTH / 4) % MAP_WIDTH;
            for (int c = 0; c < 3; ++c) {
                const double radiance = rgb[static_cast<std::size_t>(3 * (i * MAP_WIDTH + from) + c)];
                const double byte = 255 * std::pow(std::min(exposure * radiance, 1.0), 1 / 2.2);
                const double linear = shown.rgb[static_cast<std::size_t>(3 * (i * MAP_WIDTH + j) + c)];
                // Half a step of rounding, and a little for the kernel's float32 power.
                EXPECT_NEAR(255 * std::pow(linear, 1 / 2.2), byte, 0.51) << i << " " << j << " " << c;
            }
        }
    }
}

TEST_F(ReproduceRun, CommandsOfThePageGiveTheFigures) {
    const TempFolder again;
    for (const auto& id : SPHERES) {
        for (const json& numbers : {figure(id), figure(id).at("control")}) {
            EXPECT_EQ(run_in_shell(numbers.at("command"), again.path()), 0) << numbers.at("command");
            const std::string file = numbers.at("file");
            EXPECT_EQ(read_file(again.path() / file), read_file(out(file))) << file;
        }
    }
    for (const char* id : {"figure_07", "figure_11", "figure_12", "figure_15"}) {
        EXPECT_EQ(run_in_shell(figure(id).at("command"), again.path()), 0) << figure(id).at("command");
        const std::string file = figure(id).at("file");
        EXPECT_EQ(read_file(again.path() / file), read_file(out(file))) << file;
    }
    EXPECT_EQ(run_in_shell(figure("figure_02").at("command"), again.path()), 0);
    EXPECT_EQ(read_file(again.path() / "samples_64.png"), read_file(out("figure_02.png")));
    EXPECT_EQ(read_file(again.path() / "samples_64.csv"), read_file(out("figure_02.csv")));
    EXPECT_EQ(run_in_shell(figure("figure_01b").at("command"), again.path()), 0);
    EXPECT_EQ(read_svg_plot(read_file(again.path() / "figure_01b.svg")).curve("mean").points.size(),
              figure("figure_01b").at("angle_deg").size());
}

TEST_F(ReproduceRun, ErrorsAreThoseThatCompareFindsAgainstTheExactSphere) {
    const TempFolder again;
    const auto render = [&](std::vector<std::string> words, const std::string& file) {
        words.insert(words.begin(), {"render", folder_->file("sky.pfm"), "--rotate-y", "90", "--size", "64", "--seed",
                                     "3", "-o", again.file(file)});
        EXPECT_EQ(run_program(words).exit_code, 0);
        return read_picture(again.path() / file);
    };
    const Picture exact = render({"--estimator", "exact"}, "exact.exr");
    for (const auto& id : SPHERES) {
        const Picture picture = render(
            {"--estimator", figure(id).at("estimator"), "-n", std::to_string(figure(id).at("samples").get<int>()),
             "--sequence", "random", "--control-degree", "0"},
            id + ".exr");
        const Comparison difference = compare(picture, exact);
        constexpr double ROUNDING = 1e-6;  // of both pictures to float32, in parts of their mean
        EXPECT_NEAR(figure(id).at("rel_rmse"), difference.rel_rmse, ROUNDING);
        EXPECT_NEAR(figure(id).at("bias"), difference.rel_bias, ROUNDING);
    }
}

TEST_F(ReproduceRun, SharedErrorsAreSmoothAndFreshOnesAreGrain) {
    for (const auto& id : SPHERES) {
        const double correlation = figure(id).at("neighbour_correlation");
        if (figure(id).at("estimator") == "shared") {
            EXPECT_GT(correlation, 0.9) << id;
        } else {
            // About 3,000 independent pairs scatter by 1 / sqrt(3000) = 0.018; this is five times that.
            EXPECT_LT(std::abs(correlation), 0.09) << id;
        }
    }
}

TEST_F(ReproduceRun, FittedSlopesAreThoseOfRandomSampling) {
    const json fits = figure("figure_15").at("fits");
    for (const auto& [name, fit] : fits.items()) {
        const double slope = fit.at("slope");
        const double half_width = fit.at("half_width_95");
        // Twice the 95 % interval: 4 standard errors, which the fixed seed either passes or does not.
        EXPECT_NEAR(slope, -0.5, 2 * half_width) << name;
        EXPECT_LT(half_width, 0.25) << name;
    }
}

TEST_F(ReproduceRun, PointsOfTheConvergencePlotAreTheStudies) {
    const auto drawn = read_svg_plot(read_file(out("figure_15.svg")));
    std::size_t found = 0;
    for (const auto& curve : drawn.curves) {
        if (curve.label.rfind("fresh sets", 0) != 0) continue;
        for (const auto& study : report_.at("studies")) {
            if (study.at("estimator") != "per-pixel" || study.at("control_degree") != 0) continue;
            const auto near = [&](const Point& point) {
                // The SVG writes hundredths of a pixel; a decade is at least 20 pixels, so 0.2 % at most.
                constexpr double PRINTED = 0.003;
                return std::abs(point.x / study.at("samples").get<double>() - 1) < PRINTED &&
                       std::abs(point.y / (100 * study.at("rel_rmse").get<double>()) - 1) < PRINTED;
            };
            EXPECT_TRUE(std::any_of(curve.points.begin(), curve.points.end(), near)) << study.at("samples");
            ++found;
        }
    }
    EXPECT_EQ(found, 5U);
}

TEST_F(ReproduceRun, PageHoldsEveryFigureAndNeedsNothingElse) {
    const std::string html = page();
    for (const auto& [id, numbers] : report_.at("figures").items()) {
        const std::string bytes = read_file(out(numbers.at("file")));
        const bool is_svg = numbers.at("file").get<std::string>().ends_with(".svg");
        EXPECT_TRUE(html.find(is_svg ? bytes : base64(bytes)) != std::string::npos) << id;
        EXPECT_THAT(html, HasSubstr("id=\"about_" + id + "\"")) << id;
    }
    // Addresses: those of the SVG's name spaces name no file.
    static const std::regex address("(src|href)=[\"'](?!data:|#)[^\"']*");
    std::string without_data = std::regex_replace(html, std::regex("base64,[A-Za-z0-9+/=]{1,}"), "");
    std::smatch match;
    EXPECT_FALSE(std::regex_search(without_data, match, address)) << match.str();
    for (const char* loads : {"<script", "<link", "@import", "url(http", "<iframe"}) {
        EXPECT_THAT(without_data, Not(HasSubstr(loads)));
    }
    // Every id once, or links and colours of plots would cross.
    static const std::regex id_pattern(" id=[\"']([^\"']+)[\"']");
    std::set<std::string> ids;
    for (std::sregex_iterator it(without_data.begin(), without_data.end(), id_pattern), end; it != end; ++it) {
        const std::string id = (*it)[1];
        EXPECT_TRUE(ids.insert(id).second) << id;
    }
}

TEST_F(ReproduceRun, NumbersOfThePageAreThoseOfTheReport) {
    std::string html = std::regex_replace(page(), std::regex("base64,[A-Za-z0-9+/=]{1,}"), "");
    static const std::regex pattern("data-key=\"([^\"]+)\"(?: data-factor=\"([^\"]+)\")?>([^<]*)<");
    std::size_t count = 0;
    for (std::sregex_iterator it(html.begin(), html.end(), pattern), end; it != end; ++it, ++count) {
        const json::json_pointer key((*it)[1].str());
        ASSERT_TRUE(report_.contains(key)) << key.to_string();
        const double factor = (*it)[2].matched ? std::stod((*it)[2]) : 1;
        std::string shown = std::regex_replace((*it)[3].str(), std::regex("−"), "-");
        const auto point = shown.find('.');
        const auto exponent = shown.find('e');
        const auto digits = point == std::string::npos ? 0 : std::min(exponent, shown.size()) - point - 1;
        const double unit = std::pow(10, -static_cast<double>(digits)) *
                            (exponent == std::string::npos ? 1 : std::pow(10, std::stod(shown.substr(exponent + 1))));
        EXPECT_NEAR(std::stod(shown), factor * report_.at(key).get<double>(), 0.5001 * unit) << key.to_string();
    }
    EXPECT_GT(count, 200U);
    EXPECT_THAT(html, Not(HasSubstr("—</dd>")));
}

TEST(Reproduce, ASingleFigureIsWrittenAlone) {
    const TempFolder folder;
    const auto result = run_program({"reproduce", "--only", "figure_01a", "-o", folder.file("out")});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(names_in(folder.path() / "out"), std::vector<std::string>{"figure_01a.svg"});
}

TEST(Reproduce, BadInputIsOneClearLine) {
    const TempFolder folder;
    write_pfm(folder.path() / "black.pfm", 8, 4, std::vector<float>(96, 0.0F));
    write_pfm(folder.path() / "grey.pfm", 8, 4, std::vector<float>(96, 0.5F));
    const auto black = run_program({"reproduce", folder.file("black.pfm"), "-o", folder.file("out")});
    EXPECT_EQ(black.exit_code, INPUT);
    EXPECT_THAT(black.err, HasSubstr("nothing to draw"));
    const auto grey = [&](std::vector<std::string> words) {
        words.insert(words.begin(), {"reproduce", folder.file("grey.pfm"), "--size", "16", "-o", folder.file("out")});
        return run_program(words);
    };
    EXPECT_EQ(grey({"--scale", "0"}).exit_code, USAGE);
    EXPECT_EQ(grey({"--seeds", "1"}).exit_code, USAGE);
    EXPECT_EQ(grey({"--exposure", "nan"}).exit_code, USAGE);
    const auto unknown = grey({"--only", "figure_99"});
    EXPECT_EQ(unknown.exit_code, USAGE);
    EXPECT_THAT(unknown.err, HasSubstr("figure_99"));
    EXPECT_EQ(names_in(folder.path()), (std::vector<std::string>{"black.pfm", "grey.pfm"}));
    const auto unwritable = run_program({"reproduce", folder.file("grey.pfm"), "-o", "/dev/null/out"});
    EXPECT_EQ(unwritable.exit_code, OUTPUT);
    EXPECT_THAT(unwritable.err, HasSubstr("/dev/null"));
}

TEST(Reproduce, AngleBetweenColumnsMixesTheTwoThatAColumnCovers) {
    const std::array<float, 4> values = {1, 2, 4, 8};
    const RadianceMap map = row_map(values);
    const auto red = [](const RadianceMap& turned) {
        std::vector<float> row;
        for (std::size_t j = 0; j < turned.width; ++j) row.push_back(turned.rgb[3 * j]);
        return row;
    };
    EXPECT_EQ(red(turned_map(map, 90)), (std::vector<float>{8, 1, 2, 4}));
    EXPECT_EQ(red(turned_map(map, -90)), (std::vector<float>{2, 4, 8, 1}));
    EXPECT_EQ(red(turned_map(map, 360)), (std::vector<float>{1, 2, 4, 8}));
    EXPECT_EQ(red(turned_map(map, 22.5)), (std::vector<float>{2.75, 1.75, 3.5, 7}));
    EXPECT_EQ(red(turned_map(map, 22.5 - 3600)), (std::vector<float>{2.75, 1.75, 3.5, 7}));
}

TEST(Reproduce, LargeMapsShrinkToMeansForThePage) {
    const RadianceMap map = ramp_map(5, 3);
    EXPECT_EQ(shrink_factor(map, 5), 1U);
    EXPECT_EQ(shrink_factor(map, 4), 2U);
    const RadianceMap small = shrunk_map(map, 2);
    ASSERT_EQ(small.width, 3U);
    ASSERT_EQ(small.height, 2U);
    EXPECT_EQ(small.rgb[0], 1.5F);                // columns 1 and 2
    EXPECT_EQ(small.rgb[3 * 2], 5.0F);            // the last column alone
    EXPECT_EQ(small.rgb[3 * (3 + 0) + 1], 3.0F);  // the last row alone
}

TEST(Reproduce, PowerLawAndItsIntervalAreThoseOfLeastSquares) {
    const std::vector<double> x = {1, 2, 4, 8};
    std::vector<double> y;
    for (const double value : x) y.push_back(3 / std::sqrt(value));
    const PowerLaw exact = fit_power_law(x, y);
    EXPECT_NEAR(exact.slope, -0.5, 1e-14);
    EXPECT_NEAR(exact.factor, 3, 1e-13);
    EXPECT_NEAR(exact.half_width, 0, 1e-13);
    // ln y = -0.5 u + (e, -e, -e, e) in steps of ln 2: residuals as they are, since they are orthogonal to the line.
    const double e = 0.1;
    for (std::size_t i = 0; i < y.size(); ++i) y[i] *= std::exp(i == 0 || i == 3 ? e : -e);
    const PowerLaw noisy = fit_power_law(x, y);
    EXPECT_NEAR(noisy.slope, -0.5, 1e-14);
    const double uu = 5 * std::log(2) * std::log(2);
    constexpr double STUDENT_2 = 4.302653;  // a table's value; the series is within 1 % of it
    EXPECT_NEAR(noisy.half_width, STUDENT_2 * std::sqrt(4 * e * e / 2 / uu), 0.01 * noisy.half_width);
    EXPECT_NEAR(student_95(10), 2.228139, 1e-4);
    EXPECT_NEAR(student_95(78), 1.990847, 1e-6);
}

}  // namespace
}  // namespace clerestory::test
