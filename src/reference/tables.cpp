#include "reference/tables.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace clerestory::reference {
namespace {

using u128 = unsigned __int128;

constexpr std::uint64_t ONE = std::uint64_t{1} << 31;
constexpr std::uint64_t MARGIN = 256;
constexpr int FIXED_BITS = 29;

bool is_bad(const float* texel) {
    return std::any_of(texel, texel + 3, [](float v) { return !std::isfinite(v) || v < 0; });
}
bool has_light(const float* texel) {
    return std::any_of(texel, texel + 3, [](float v) { return v > 0; });
}

/// floor(value / 2^shift) or value * 2^-shift.
u128 shifted_down(u128 value, int shift) {
    if (shift >= 128) return 0;
    return shift >= 0 ? value >> shift : value << -shift;
}

int bit_length(u128 value) {
    int bits = 0;
    for (; value != 0; value >>= 1) ++bits;
    return bits;
}

/// The exponent e of step 1.
int exponent_above(float largest) {
    int exponent = 0;
    std::frexp(largest, &exponent);
    return std::clamp(exponent, -126, 126);
}

/// Step 2. A product of two floats is exact in double, so each rounding below is the one float32 makes.
float row_intensity(const float* texel, int exponent, const std::array<float, 3>& luminance) {
    std::array<float, 3> term{};
    for (std::size_t c = 0; c < 3; ++c) {
        const auto scaled = static_cast<float>(std::ldexp(static_cast<double>(texel[c]), -exponent));
        term[c] = static_cast<float>(static_cast<double>(luminance[c]) * static_cast<double>(scaled));
    }
    // A sum of two floats in double is rounded at 53 bits first, which is harmless: 53 >= 2 * 24 + 2.
    const auto two = static_cast<float>(static_cast<double>(term[0]) + static_cast<double>(term[1]));
    return static_cast<float>(static_cast<double>(two) + static_cast<double>(term[2]));
}

std::uint64_t rounded_to_even(double value) {
    const double low = std::floor(value);
    const double rest = value - low;
    const auto down = static_cast<std::uint64_t>(low);
    if (rest > 0.5 || (rest == 0.5 && down % 2 == 1)) return down + 1;
    return down;
}

/// A row's share of step 1: mantissa * 2^exponent.
struct Share {
    u128 mantissa = 0;
    int exponent = 0;
};

Share row_share(const RowTable& row, float sine) {
    const int drop = bit_length(row.sum) - 40;
    int sine_exponent = 0;
    const float fraction = std::frexp(sine, &sine_exponent);
    Share share;
    share.mantissa = shifted_down(row.sum, drop) * static_cast<u128>(std::ldexp(fraction, 24));
    share.exponent = row.exponent + drop + sine_exponent;
    return share;
}

}  // namespace

long double row_sine(std::size_t row, std::size_t height) {
    const auto from_pole = static_cast<long double>(std::min(row, height - 1 - row));
    return std::sin(std::numbers::pi_v<long double> * (from_pole + 0.5L) / static_cast<long double>(height));
}

std::array<long double, 3> luminance_shares(Luminance luminance) {
    if (luminance == Luminance::rec709) return {0.2126L, 0.7152L, 0.0722L};
    return {1.0L / 3, 1.0L / 3, 1.0L / 3};
}

std::vector<long double> intensities(const RadianceMap& map, Luminance luminance) {
    const auto share = luminance_shares(luminance);
    std::vector<long double> intensity(map.width * map.height);
    for (std::size_t at = 0; at < intensity.size(); ++at) {
        for (std::size_t c = 0; c < 3; ++c) intensity[at] += share[c] * static_cast<long double>(map.rgb[3 * at + c]);
    }
    return intensity;
}

long double phi(const RadianceMap& map, Luminance luminance) {
    constexpr long double pi = std::numbers::pi_v<long double>;
    const auto intensity = intensities(map, luminance);
    const auto height = static_cast<long double>(map.height);
    long double sum = 0;
    for (std::size_t at = 0; at < intensity.size(); ++at) sum += intensity[at] * row_sine(at / map.width, map.height);
    return sum * 2 * pi / static_cast<long double>(map.width) * 2 * std::sin(pi / (2 * height));
}

MapCounts count_texels(const RadianceMap& map) {
    MapCounts found;
    for (std::size_t at = 0; at < map.width * map.height; ++at) {
        const float* texel = map.rgb.data() + 3 * at;
        if (!is_bad(texel)) {
            found.zero += has_light(texel) ? 0 : 1;
            found.max_component = std::max({found.max_component, texel[0], texel[1], texel[2]});
            continue;
        }
        if (found.bad() == 0) {
            found.first_bad_row = at / map.width;
            found.first_bad_column = at % map.width;
        }
        if (std::any_of(texel, texel + 3, [](float v) { return std::isnan(v); })) {
            ++found.nan;
        } else if (std::any_of(texel, texel + 3, [](float v) { return std::isinf(v); })) {
            ++found.inf;
        } else {
            ++found.negative;
        }
    }
    return found;
}

RowTable row_table(std::span<const float> rgb, const std::array<float, 3>& luminance) {
    RowTable table;
    const std::size_t width = rgb.size() / 3;
    table.end.assign(width, 0);
    const float largest = *std::max_element(rgb.begin(), rgb.end());
    if (!(largest > 0)) return table;
    table.exponent = exponent_above(largest);

    std::vector<float> intensity(width);
    for (std::size_t j = 0; j < width; ++j) {
        intensity[j] = row_intensity(&rgb[3 * j], table.exponent, luminance);
        table.sum += rounded_to_even(std::ldexp(static_cast<double>(intensity[j]), FIXED_BITS));
        table.lit += has_light(&rgb[3 * j]) ? 1 : 0;
    }

    const u128 room = ONE - MARGIN - table.lit;
    const u128 exact_per_unit = (room << 32) / (table.sum + table.lit);
    const int cut = std::max(0, bit_length(exact_per_unit) - 24);
    const u128 per_unit = exact_per_unit >> cut << cut;
    // per_unit / 2^32 counts a unit of 2^-29.
    const double per_intensity = std::ldexp(static_cast<double>(per_unit), FIXED_BITS - 32);
    std::vector<std::uint64_t> running(width);
    std::uint64_t total = 0;
    for (std::size_t j = 0; j < width; ++j) {
        if (has_light(&rgb[3 * j])) {
            const auto product = static_cast<float>(static_cast<double>(intensity[j]) * per_intensity);
            total += std::max<std::uint64_t>(1, static_cast<std::uint64_t>(product));
        }
        running[j] = total;
    }
    const u128 stretch = (static_cast<u128>(ONE - total) << 32) / total;
    for (std::size_t j = 0; j < width; ++j) {
        const std::uint64_t end =
            running[j] == total ? ONE : running[j] + static_cast<std::uint64_t>((running[j] * stretch) >> 32);
        table.end[j] = static_cast<std::uint32_t>(end);
    }
    return table;
}

std::vector<std::uint32_t> marginal(std::span<const RowTable> rows, std::span<const float> sine) {
    const std::size_t height = rows.size();
    std::vector<Share> shares(height);
    int top = 0;  // the largest share is below 2^top
    std::uint64_t lit_rows = 0;
    for (std::size_t i = 0; i < height; ++i) {
        if (rows[i].lit == 0) continue;
        shares[i] = row_share(rows[i], sine[i]);
        const int above = shares[i].exponent + bit_length(shares[i].mantissa);
        top = lit_rows == 0 ? above : std::max(top, above);
        ++lit_rows;
    }
    std::vector<std::uint32_t> ends(height, 0);
    if (lit_rows == 0) return ends;

    const int unit = top - (62 - (bit_length(height) - 1));
    std::vector<u128> running(height);
    u128 total = 0;
    for (std::size_t i = 0; i < height; ++i) {
        if (rows[i].lit != 0) total += std::max<u128>(1, shifted_down(shares[i].mantissa, unit - shares[i].exponent));
        running[i] = total;
    }
    const int lead = 64 - bit_length(total);
    const u128 per_unit = (static_cast<u128>(ONE - lit_rows) << 32) / (((total << lead) >> 32) + 1);
    std::uint64_t lit_so_far = 0;
    for (std::size_t i = 0; i < height; ++i) {
        lit_so_far += rows[i].lit != 0 ? 1 : 0;
        const u128 end = running[i] == total ? ONE : (((running[i] << lead) * per_unit) >> 64) + lit_so_far;
        ends[i] = static_cast<std::uint32_t>(end);
    }
    return ends;
}

}  // namespace clerestory::reference
