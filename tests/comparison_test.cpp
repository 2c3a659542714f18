// What `compare` measures, on pictures whose differences are known.
#include "comparison.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>

#include "error.hpp"

namespace clerestory {
namespace {

constexpr std::size_t SIDE = 5;

/// Without alpha, every value the same.
Picture flat(float value, std::size_t side = SIDE) {
    return {side, side, std::vector<float>(3 * side * side, value), {}};
}

void set_pixel(Picture& picture, std::size_t row, std::size_t column, float value) {
    for (std::size_t c = 0; c < 3; ++c) picture.rgb[3 * (row * picture.width + column) + c] = value;
}

TEST(Comparison, WithoutAlphaTheUnitDiscCounts) {
    const Picture reference = flat(2);
    Picture picture = flat(2);
    // Of 5x5 pixels the four corners' centres lie outside, at 0.8 sqrt 2 from the centre.
    for (const std::size_t row : {0U, 4U}) {
        for (const std::size_t column : {0U, 4U}) set_pixel(picture, row, column, 1000);
    }
    const Comparison same = compare(picture, reference);
    EXPECT_EQ(same.pixels, 21U);
    EXPECT_EQ(same.rmse, 0);
    EXPECT_EQ(same.psnr, std::numeric_limits<double>::infinity());

    set_pixel(picture, 0, 1, 5);  // inside, at the edge
    const Comparison other = compare(picture, reference);
    EXPECT_DOUBLE_EQ(other.rmse, 3 / std::sqrt(21.0));
    EXPECT_DOUBLE_EQ(other.rel_rmse, 1.5 / std::sqrt(21.0));
    EXPECT_DOUBLE_EQ(other.bias, 3 / 21.0);
    EXPECT_EQ(other.max_abs, 3);
}

TEST(Comparison, OnlyPixelsThatBothShowCount) {
    Picture reference = flat(1);
    reference.alpha.assign(SIDE * SIDE, 0);
    reference.alpha[0] = 1;                // a corner, outside of the other one's disc
    reference.alpha[2 * SIDE + 2] = 0.5F;  // the centre
    Picture picture = flat(1);
    set_pixel(picture, 2, 2, 3);
    const Comparison found = compare(picture, reference);
    EXPECT_EQ(found.pixels, 1U);
    EXPECT_EQ(found.rmse, 2);
    reference.alpha[2 * SIDE + 2] = 0;
    EXPECT_THROW(compare(picture, reference), InputError);
}

TEST(Comparison, AgainstBlackErrorsAreInfiniteAndKeepTheirSign) {
    const Comparison below = compare(flat(-1), flat(0));
    EXPECT_EQ(below.rel_rmse, std::numeric_limits<double>::infinity());
    EXPECT_EQ(below.rel_bias, -std::numeric_limits<double>::infinity());
    EXPECT_EQ(compare(flat(0), flat(0)).rel_rmse, 0);
}

TEST(Comparison, WhatHasNoErrorIsRefused) {
    EXPECT_THROW(compare(flat(1), flat(1, 7)), InputError);
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        Picture picture = flat(1);
        set_pixel(picture, 2, 3, bad);
        EXPECT_THROW(compare(picture, flat(1)), InputError);
        EXPECT_THROW(compare(flat(1), picture), InputError);
        picture = flat(1);
        set_pixel(picture, 0, 0, bad);
        EXPECT_EQ(compare(picture, flat(1)).rmse, 0) << "beside the disc";
    }
}

}  // namespace
}  // namespace clerestory
