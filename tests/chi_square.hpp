#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace clerestory::test {

// The test's own law holds where each class expects enough counts; 5 is the textbook's least. Rarer texels are pooled.
// Source: Cochran, Some methods for strengthening the common chi-square tests, Biometrics 10 (1954).
inline constexpr double LEAST_EXPECTED = 5;
// How many standard deviations of the normal law a statistic may lie above: 5 is met by chance once in 3.5 million
// tests. Seeds are fixed, so a test that passes keeps passing.
inline constexpr double CHI_SQUARE_SIGMAS = 5;

/// A goodness of fit as a standard normal deviate, by Wilson and Hilferty's cube root; and what ruled it out
/// altogether.
struct ChiSquare {
    double sigmas = 0;
    std::size_t classes = 0;
    std::uint64_t impossible = 0;  ///< counts where the probability is 0
};

/// Holds counts against probabilities, which add up to 1. Elements are pooled from the rarest on.
inline ChiSquare chi_square(std::span<const std::uint64_t> counts, std::span<const double> probabilities) {
    ChiSquare result;
    std::uint64_t total = 0;
    for (const std::uint64_t count : counts) total += count;
    std::vector<std::size_t> order(counts.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return probabilities[a] < probabilities[b]; });
    double statistic = 0;
    double expected = 0;
    double found = 0;
    const auto close_class = [&] {
        statistic += (found - expected) * (found - expected) / expected;
        ++result.classes;
        expected = 0;
        found = 0;
    };
    for (const std::size_t at : order) {
        if (probabilities[at] == 0) {
            result.impossible += counts[at];
            continue;
        }
        expected += probabilities[at] * static_cast<double>(total);
        found += static_cast<double>(counts[at]);
        if (expected >= LEAST_EXPECTED) close_class();
    }
    if (expected > 0 && result.classes == 0) close_class();
    if (result.classes < 2) return result;  // one class holds everything: nothing to test but `impossible`
    const auto freedom = static_cast<double>(result.classes - 1);
    const double spread = 2 / (9 * freedom);
    result.sigmas = (std::cbrt(statistic / freedom) - (1 - spread)) / std::sqrt(spread);
    return result;
}

}  // namespace clerestory::test
