// Errors over the sphere's pixels: numbers that are known by hand.
#include "measure/error_statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "shading/pixels.hpp"
#include "test_device.hpp"

namespace clerestory::test {
namespace {

constexpr std::size_t SIZE = 65;
// Sums of ten thousand float32 products in double.
constexpr double ROUNDING = 1e-6;

class ErrorStatisticsTest : public ::testing::Test {
  protected:
    /// Errors by place in the picture, in all three channels.
    [[nodiscard]] ErrorPlanes errors(const std::function<float(std::size_t row, std::size_t column)>& error) const {
        const auto pixel = view_.pixel.download();
        ErrorPlanes planes(3 * view_.count);
        for (std::size_t i = 0; i < planes.size(); ++i) {
            const std::size_t at = pixel[i % view_.count];
            planes[i] = error(at / SIZE, at % SIZE);
        }
        return planes;
    }

    TestDevice device_;
    SphereView view_{device_, SIZE};
    ErrorStatistics statistics_{view_};
};

TEST_F(ErrorStatisticsTest, NeighboursInARowAreFoundWhateverTheListsOrder) {
    EXPECT_NEAR(statistics_.parts_of(errors([](auto, auto) { return 1.0F; })).neighbour_correlation, 1, ROUNDING);
    const auto stripes = errors([](auto, std::size_t column) { return column % 2 == 0 ? 1.0F : -1.0F; });
    EXPECT_NEAR(statistics_.parts_of(stripes).neighbour_correlation, -1, ROUNDING);
    // Only neighbours to the left and right count, not those above and below.
    const auto rows = errors([](std::size_t row, auto) { return row % 2 == 0 ? 1.0F : -1.0F; });
    EXPECT_NEAR(statistics_.parts_of(rows).neighbour_correlation, 1, ROUNDING);
}

TEST_F(ErrorStatisticsTest, EveryPairOfNeighboursCounts) {
    // Two pixels of the middle row, each with two neighbours of which one is the other: in four of its pairs' ends it
    // stands, so that the products' sum is 1 and the squares' 2.
    const auto two = errors([](std::size_t row, std::size_t column) {
        return row == SIZE / 2 && (column == SIZE / 2 || column == SIZE / 2 + 1) ? 1.0F : 0.0F;
    });
    EXPECT_NEAR(statistics_.parts_of(two).neighbour_correlation, 0.5, ROUNDING);
    // Wherever in the disc they lie: on the list they are neighbours in one case out of four.
    for (std::size_t column = 4; column + 5 < SIZE; ++column) {
        const auto moved = errors([&](std::size_t row, std::size_t at) {
            return row == SIZE / 2 && (at == column || at == column + 1) ? 1.0F : 0.0F;
        });
        EXPECT_NEAR(statistics_.parts_of(moved).neighbour_correlation, 0.5, ROUNDING) << column;
    }
}

TEST_F(ErrorStatisticsTest, ConstantErrorsAreBiasAndStayInBlocks) {
    const ErrorParts parts = statistics_.parts_of(errors([](auto, auto) { return -0.25F; }));
    EXPECT_NEAR(parts.rel_rmse, 0.25, ROUNDING);
    EXPECT_NEAR(parts.rel_bias, -0.25, ROUNDING);
    for (const double rms : parts.block_rms) EXPECT_NEAR(rms, 0.25, ROUNDING);
}

TEST_F(ErrorStatisticsTest, AChessboardVanishesInBlocks) {
    const auto board = errors([](std::size_t row, std::size_t column) { return (row + column) % 2 ? 1.0F : -1.0F; });
    const std::vector<double> rms = statistics_.block_rms(board);
    ASSERT_GT(rms.size(), 1U);
    EXPECT_NEAR(rms[0], 1, ROUNDING);
    for (std::size_t k = 1; k < rms.size(); ++k) EXPECT_NEAR(rms[k], 0, ROUNDING);
}

TEST_F(ErrorStatisticsTest, PicturesHaveTheMeanOfTheChannelsAndNothingBesideTheSphere) {
    const auto picture = statistics_.as_picture(errors([](std::size_t row, auto) { return static_cast<float>(row); }));
    ASSERT_EQ(picture.size(), SIZE * SIZE);
    EXPECT_TRUE(std::isnan(picture[0]));
    EXPECT_FLOAT_EQ(picture[(SIZE / 2) * SIZE + SIZE / 2], SIZE / 2);
}

}  // namespace
}  // namespace clerestory::test
