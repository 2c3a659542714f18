#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace clerestory {

/// A sum of doubles without any rounding: a fixed-point integer wide enough for products of three floats.
/// Holds magnitudes from 2^-640 to 2^480 and up to 2^30 terms between two calls of value().
class ExactSum {
  public:
    void add(double term);
    /// Adds a * b * c exactly, where a * b has at most 53 bits.
    void add_product(float a, float b, float c);
    /// The sum, which is not negative, to within one ulp of long double.
    [[nodiscard]] long double value();

  private:
    static constexpr int DIGIT_BITS = 32;
    static constexpr int LOWEST = -704;  ///< exponent of the first digit's unit
    static constexpr std::size_t DIGITS = 40;
    std::array<std::int64_t, DIGITS> digit_{};  ///< digit_[k] * 2^(LOWEST + DIGIT_BITS * k), any sign
};

}  // namespace clerestory
