#pragma once

#include <cstddef>

#include "clerestory/export.hpp"
#include "clerestory/image.hpp"

namespace clerestory {

/// How one picture differs from another, over pixels that both show (see compare) and three channels together.
struct Comparison {
    std::size_t pixels = 0;
    double rmse = 0;
    double rel_rmse = 0;  ///< over the reference's mean; infinite where that is 0 and the rmse is not
    double bias = 0;      ///< mean of A - B
    double rel_bias = 0;  ///< over the reference's mean
    double max_abs = 0;
    double psnr = 0;  ///< decibels, from the reference's largest value; infinite where the pictures are equal
    double reference_mean = 0;
};

/// Compares `a` with the reference `b`: over pixels with alpha in both; where a file has no alpha, over its unit disc.
/// Throws InputError where the sizes differ, or no pixel is left, or a value is not finite.
CLERESTORY_API Comparison compare(const Picture& a, const Picture& b);

}  // namespace clerestory
