#include "draw/plot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <regex>
#include <set>

#include "error.hpp"
#include "run_program.hpp"
#include "svg_plot.hpp"

namespace clerestory::plot {
namespace {

using test::read_svg_plot;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

Plot sample_plot(const std::string& name = "sample") {
    Plot plot;
    plot.name = name;
    plot.title = "Error against samples";
    plot.x = {"samples", "", 0.0, 4.0};
    plot.y = {"error", "%", 0.0, 10.0};
    plot.curves = {{"falling", {0, 1, 2, 3, 4}, {9, 7, 5, 2, 1}},
                   {"rising", {0, 1, 2, 3, 4}, {1, 2, 3, 5, 8}, Style::points}};
    return plot;
}

TEST(Plot, LinesAndPointsLieWhereTheirDataSay) {
    const auto plot = sample_plot();
    const auto drawn = read_svg_plot(svg(plot));
    for (const auto& curve : plot.curves) {
        const auto& found = drawn.curve(curve.label);
        ASSERT_EQ(found.points.size(), curve.x.size()) << curve.label;
        for (std::size_t i = 0; i < curve.x.size(); ++i) {
            EXPECT_NEAR(found.points[i].x, curve.x[i], drawn.x_resolution());
            EXPECT_NEAR(found.points[i].y, curve.y[i], drawn.y_resolution());
        }
    }
}

TEST(Plot, LogarithmicAxesPlacePointsByTheirLogarithm) {
    auto plot = sample_plot();
    plot.x = {"samples", "", 1.0, 1e4, {}, true};
    plot.y = {"error", "", 1e-4, 1.0, {}, true};
    plot.curves = {{"slope", {1, 10, 100, 1000, 10000}, {1, 1e-1, 1e-2, 1e-3, 1e-4}, Style::line_with_points}};
    const auto drawn = read_svg_plot(svg(plot));
    constexpr double HUNDREDTHS = 1e-3;  // 0.02 pixels of 250 that hold four decades: 0.07 % of the value
    ASSERT_EQ(drawn.curves.at(0).points.size(), 5U);
    for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_NEAR(drawn.curves[0].points[i].x / plot.curves[0].x[i], 1, HUNDREDTHS);
        EXPECT_NEAR(drawn.curves[0].points[i].y / plot.curves[0].y[i], 1, HUNDREDTHS);
    }
}

TEST(Plot, MarksStandAtTheirPlacesWithTheirLabels) {
    auto plot = sample_plot();
    plot.marks = {{1.25, "a place"}, {3.5, "another", Direction::vertical, Side::after}};
    const auto drawn = read_svg_plot(svg(plot));
    ASSERT_EQ(drawn.vertical_marks.size(), 2U);
    EXPECT_NEAR(drawn.vertical_marks[0], 1.25, drawn.x_resolution());
    EXPECT_NEAR(drawn.vertical_marks[1], 3.5, drawn.x_resolution());
    EXPECT_THAT(drawn.texts, Contains("a place"));
    EXPECT_THAT(drawn.texts, Contains("another"));
}

TEST(Plot, AxesSayTheirUnits) {
    const auto drawn = read_svg_plot(svg(sample_plot()));
    EXPECT_THAT(drawn.texts, Contains("samples"));
    EXPECT_THAT(drawn.texts, Contains("error [%]"));
    EXPECT_THAT(drawn.texts, Contains("Error against samples"));
}

TEST(Plot, TextsMeanThemselvesWhateverTheirCharacters) {
    auto plot = sample_plot();
    plot.title = "a_b^{c} 'quoted' & <tagged> \\n \"double\" `date` {/=20 big} \xC2\xB5";
    plot.curves[0].label = "it's x_1 & y<2";
    const auto drawn = read_svg_plot(svg(plot));
    EXPECT_THAT(drawn.texts, Contains(plot.title));
    EXPECT_THAT(drawn.texts, Contains(plot.curves[0].label));
}

TEST(Plot, BandsErrorBarsNotesAndHorizontalMarksAreDrawn) {
    auto plot = sample_plot();
    plot.bands = {{"spread", {0, 2, 4}, {1, 2, 3}, {2, 4, 6}}};
    plot.curves[0].low = {8, 6, 4, 1, 0};
    plot.curves[0].high = {10, 8, 6, 3, 2};
    plot.marks = {{5, "half", Direction::horizontal, Side::after}};
    plot.notes = {{3, 2, "best"}};
    const auto text = svg(plot);
    const auto drawn = read_svg_plot(text);
    EXPECT_THAT(text, HasSubstr("<polygon"));
    EXPECT_THAT(drawn.texts, testing::IsSupersetOf({"spread", "falling", "half", "best"}));
    EXPECT_NO_THROW(png(plot));
}

TEST(Plot, PointsThatAreNotNumbersAreLeftOut) {
    auto plot = sample_plot();
    plot.curves[1].y = {1, std::nan(""), 3, std::numeric_limits<double>::infinity(), 8};
    EXPECT_EQ(read_svg_plot(svg(plot)).curve("rising").points.size(), 3U);
    plot.curves[1].y.assign(5, std::nan(""));
    EXPECT_THROW(svg(plot), OutputError);
}

TEST(Plot, TwoPlotsOfOnePageShareNoId) {
    const auto ids = [](const std::string& text) {
        std::multiset<std::string> found;
        const std::regex id(" id=[\"']([^\"']*)[\"']");
        for (std::sregex_iterator it(text.begin(), text.end(), id), end; it != end; ++it) found.insert((*it)[1]);
        return found;
    };
    const auto all = ids(svg(sample_plot("first")) + svg(sample_plot("second")));
    EXPECT_GT(all.size(), 10U);
    EXPECT_EQ(all.size(), std::set<std::string>(all.begin(), all.end()).size());
}

TEST(Plot, EveryReferenceInTheSvgHasItsTarget) {
    const auto text = svg(sample_plot("page_7"));
    const std::regex reference("xlink:href='#([^']*)'");
    std::size_t count = 0;
    for (std::sregex_iterator it(text.begin(), text.end(), reference), end; it != end; ++it, ++count) {
        EXPECT_THAT(text, HasSubstr("id='" + (*it)[1].str() + "'"));
    }
    EXPECT_GT(count, 5U);
}

TEST(Plot, SvgStandsInAPageAndFollowsItsScheme) {
    const auto text = svg(sample_plot());
    EXPECT_THAT(text, StartsWith("<svg "));
    EXPECT_THAT(text, HasSubstr("viewBox=\"0 0 720 460\""));
    EXPECT_THAT(text, HasSubstr("prefers-color-scheme:dark"));
    EXPECT_THAT(text, HasSubstr("aria-label=\"Error against samples\""));
    EXPECT_THAT(text, Not(HasSubstr("black")));
    EXPECT_THAT(text, Not(HasSubstr("rgb(")));
}

TEST(Plot, TheSamePlotHasTheSameBytes) { EXPECT_EQ(svg(sample_plot()), svg(sample_plot())); }

TEST(Plot, PngHasTwiceTheSize) {
    const auto bytes = png(sample_plot());
    ASSERT_GT(bytes.size(), 24U);
    EXPECT_EQ(bytes.substr(1, 3), "PNG");
    const auto big_endian = [&](std::size_t at) {
        unsigned value = 0;
        for (std::size_t i = 0; i < 4; ++i) value = value * 256 + static_cast<unsigned char>(bytes[at + i]);
        return value;
    };
    EXPECT_EQ(big_endian(16), 1440U);  // width and height of the IHDR chunk
    EXPECT_EQ(big_endian(20), 920U);
}

TEST(Plot, OtherSuffixesNamesAndUnequalArraysAreRefused) {
    const test::TempFolder folder;
    EXPECT_THROW(write(folder.path() / "plot.pdf", sample_plot()), UsageError);
    EXPECT_THROW(svg(sample_plot("two words")), OutputError);
    auto plot = sample_plot();
    plot.curves[0].y.pop_back();
    EXPECT_THROW(svg(plot), OutputError);
    plot.curves.clear();
    EXPECT_THROW(svg(plot), OutputError);
    EXPECT_THAT(test::names_in(folder.path()), testing::IsEmpty());
}

}  // namespace
}  // namespace clerestory::plot
