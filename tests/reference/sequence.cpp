#include "reference/sequence.hpp"

#include <cmath>

namespace clerestory::reference {
namespace {

constexpr int DIGITS = 32;

}  // namespace

std::array<std::uint32_t, 4> philox4x32_10(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
    constexpr std::size_t ROUNDS = 10;
    std::array<std::array<std::uint32_t, 2>, ROUNDS> keys;
    for (std::uint32_t round = 0; round < ROUNDS; ++round) {
        keys[round] = {key[0] + round * 0x9E3779B9U, key[1] + round * 0xBB67AE85U};
    }
    for (const auto& of_round : keys) {
        const std::uint64_t left = std::uint64_t{0xD2511F53U} * counter[0];
        const std::uint64_t right = std::uint64_t{0xCD9E8D57U} * counter[2];
        counter = {static_cast<std::uint32_t>(right >> 32) ^ counter[1] ^ of_round[0],
                   static_cast<std::uint32_t>(right), static_cast<std::uint32_t>(left >> 32) ^ counter[3] ^ of_round[1],
                   static_cast<std::uint32_t>(left)};
    }
    return counter;
}

std::array<std::uint32_t, 32> direction_numbers(int dimension) {
    std::array<std::uint32_t, DIGITS> v{};
    if (dimension == 1) {
        for (std::size_t i = 0; i < DIGITS; ++i) v[i] = 1U << (DIGITS - 1 - i);
        return v;
    }
    // s = 1, a = 0: m_k = 2 m_{k-1} xor m_{k-1}, and v_k = m_k / 2^k.
    std::uint64_t m = 1;
    for (std::size_t k = 1; k <= DIGITS; ++k) {
        v[k - 1] = static_cast<std::uint32_t>(m << (DIGITS - k));
        m = (m << 1) ^ m;
    }
    return v;
}

std::array<std::uint32_t, 2> sobol_point(std::uint32_t index) {
    static const std::array<std::array<std::uint32_t, DIGITS>, 2> v = {direction_numbers(1), direction_numbers(2)};
    std::array<std::uint32_t, 2> point{};
    for (std::size_t bit = 0; bit < DIGITS; ++bit) {
        if ((index >> bit & 1U) == 0) continue;
        for (std::size_t d = 0; d < 2; ++d) point[d] ^= v[d][bit];
    }
    return point;
}

std::uint32_t OwenTree::scrambled(std::uint32_t fraction) {
    std::uint32_t out = 0;
    std::uint64_t node = 1;  // the digits so far, led by a one
    for (int digit = DIGITS - 1; digit >= 0; --digit) {
        const auto [at, fresh] = coins_.try_emplace(node, 0U);
        if (fresh) at->second = static_cast<std::uint32_t>(random_() >> 63);
        const std::uint32_t own = fraction >> digit & 1U;
        out |= (own ^ at->second) << digit;
        node = 2 * node + own;
    }
    return out;
}

std::vector<Cell> cells(std::size_t count) {
    const auto columns = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(count))));
    std::vector<Cell> out;
    for (std::size_t column = 0; column < columns; ++column) {
        const std::size_t before = out.size();
        const std::size_t here = count / columns + (column < count % columns ? 1 : 0);
        for (std::size_t cell = 0; cell < here; ++cell) {
            out.push_back({static_cast<double>(before) / static_cast<double>(count),
                           static_cast<double>(before + here) / static_cast<double>(count),
                           static_cast<double>(cell) / static_cast<double>(here),
                           static_cast<double>(cell + 1) / static_cast<double>(here)});
        }
    }
    return out;
}

}  // namespace clerestory::reference
