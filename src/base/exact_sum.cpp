#include "base/exact_sum.hpp"

#include <cmath>

namespace clerestory {

void ExactSum::add(double term) {
    if (term == 0) return;
    int exponent = 0;
    const double fraction = std::frexp(term, &exponent);
    // term = mantissa * 2^(exponent - 53)
    const auto mantissa = static_cast<std::int64_t>(std::ldexp(fraction, 53));
    const int place = exponent - 53 - LOWEST;
    const auto first = static_cast<std::size_t>(place / DIGIT_BITS);
    const __int128 shifted = static_cast<__int128>(mantissa) * (static_cast<__int128>(1) << (place % DIGIT_BITS));
    digit_.at(first) += static_cast<std::int64_t>(shifted & 0xFFFFFFFF);
    digit_.at(first + 1) += static_cast<std::int64_t>((shifted >> DIGIT_BITS) & 0xFFFFFFFF);
    digit_.at(first + 2) += static_cast<std::int64_t>(shifted >> (2 * DIGIT_BITS));
}

void ExactSum::add_product(float a, float b, float c) {
    const double ab = static_cast<double>(a) * static_cast<double>(b);
    const auto factor = static_cast<double>(c);
    const double product = ab * factor;
    add(product);
    add(std::fma(ab, factor, -product));
}

long double ExactSum::value() {
    std::int64_t carry = 0;
    for (std::size_t k = 0; k < DIGITS; ++k) {
        const std::int64_t digit = digit_[k] + carry;
        carry = digit >> DIGIT_BITS;
        digit_[k] = k + 1 < DIGITS ? digit & 0xFFFFFFFF : digit;
        if (k + 1 == DIGITS) break;
    }
    std::size_t top = DIGITS;
    while (top > 0 && digit_[top - 1] == 0) --top;
    if (top == 0) return 0;
    // The three leading digits hold at least 65 bits; what lies below is a tie's breaker only.
    long double sum = 0;
    for (std::size_t k = top < 4 ? 0 : top - 4; k < top; ++k) {
        sum += std::ldexp(static_cast<long double>(digit_[k]), LOWEST + DIGIT_BITS * static_cast<int>(k));
    }
    return sum;
}

}  // namespace clerestory
