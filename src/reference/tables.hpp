#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "image.hpp"
#include "map/texel_counts.hpp"
#include "options.hpp"

/// Slow answers of their own making, to hold the kernels against.
namespace clerestory::reference {

/// sin(theta) at the centre of row `row` of `height`, theta from the nearer pole.
long double row_sine(std::size_t row, std::size_t height);

/// Weights of R, G and B in the intensity, not rounded to float.
std::array<long double, 3> luminance_shares(Luminance luminance);

/// Intensity of every texel.
///   returns [height * width]
std::vector<long double> intensities(const RadianceMap& map, Luminance luminance);

/// Integral of intensity over the sphere.
long double phi(const RadianceMap& map, Luminance luminance);

/// Counts of bad and black texels, and the brightest component of the good ones.
MapCounts count_texels(const RadianceMap& map);

/// A row's integer table.
struct RowTable {
    std::vector<std::uint32_t> end;  ///< [width], in units of 2^-31; all 0 in a black row
    std::uint64_t sum = 0;           ///< of the texels' fixed-point intensities, units of 2^(exponent - 29)
    int exponent = 0;
    std::uint32_t lit = 0;
};

/// The table of one row, rounded as the kernels state:
///   1. the row's exponent e: 2^(e-1) <= largest component < 2^e, held to -126 .. 126;
///   2. a texel's intensity, components times 2^-e, in float32 from left to right, each step rounded to nearest;
///   3. its fixed-point weight: intensity * 2^29 to the nearest, ties to even; `sum` adds these;
///   4. counts per intensity: floor((2^31 - 256 - lit) 2^32 / (sum + lit)), cut to its 24 leading bits;
///   5. a texel's count: intensity times that in float32, to nearest, cut to an integer; at least 1 where lit;
///   6. ends: the running count r of total t becomes r + floor(r floor((2^31 - t) 2^32 / t) / 2^32), and 2^31 at r = t.
///   rgb [3 * width]
RowTable row_table(std::span<const float> rgb, const std::array<float, 3>& luminance);

/// The table over rows, rounded as the kernel states:
///   1. a row's share: the 40 leading bits of its sum times the 24 bits of its sine;
///   2. cut to a common unit that leaves the largest share 62 - floor(log2(height)) bits, at least 1 where lit;
///   3. ends: floor(running share * per_unit / 2^64) + the lit rows so far, with shares shifted to the top of 64 bits
///   and
///      per_unit = floor((2^31 - lit rows) 2^32 / (floor(total / 2^32) + 1)); 2^31 from the last lit row on.
///   sine [height]
///   returns [height]
std::vector<std::uint32_t> marginal(std::span<const RowTable> rows, std::span<const float> sine);

}  // namespace clerestory::reference
