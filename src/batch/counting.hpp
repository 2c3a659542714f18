#pragma once

#include <cstddef>
#include <limits>

/// Sums and products that end at the largest number there is: what they count is not made, only refused.
namespace clerestory {

inline std::size_t saturated_sum(std::size_t a, std::size_t b) {
    constexpr std::size_t LARGEST = std::numeric_limits<std::size_t>::max();
    return a > LARGEST - b ? LARGEST : a + b;
}

inline std::size_t saturated_product(std::size_t a, std::size_t b) {
    constexpr std::size_t LARGEST = std::numeric_limits<std::size_t>::max();
    return b != 0 && a > LARGEST / b ? LARGEST : a * b;
}

}  // namespace clerestory
