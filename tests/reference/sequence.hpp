#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <unordered_map>
#include <vector>

/// What the kernels' sample points must be, written for clarity from the papers and not from the kernels.
namespace clerestory::reference {

/// Philox4x32-10 with whole 64-bit products and a key schedule made beforehand.
/// Source: Salmon, Moraes, Dror, Shaw, SC 2011, section 3.3.
std::array<std::uint32_t, 4> philox4x32_10(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key);

/// Direction numbers of Sobol's dimension 1 or 2, the first digit in the highest bit.
/// Source: Joe and Kuo, new-joe-kuo-6.21201, 2008: dimension 1 is the identity; 2 has s = 1, a = 0, m = {1}.
std::array<std::uint32_t, 32> direction_numbers(int dimension);

/// Point `index` of Sobol's sequence, dimensions 1 and 2, in units of 2^-32.
std::array<std::uint32_t, 2> sobol_point(std::uint32_t index);

/// Owen's nested uniform scramble of one dimension with every node of the tree drawn on its own as it is met.
/// Source: Owen, Randomly permuted (t,m,s)-nets and (t,s)-sequences, 1995.
class OwenTree {
  public:
    explicit OwenTree(std::uint64_t seed) : random_(seed) {}
    /// Flips each digit by the coin of the node that the digits before it lead to.
    std::uint32_t scrambled(std::uint32_t fraction);

  private:
    std::mt19937_64 random_;
    std::unordered_map<std::uint64_t, std::uint32_t> coins_;
};

/// A cell of a stratified set, in fractions of one.
struct Cell {
    double left = 0;
    double right = 1;
    double bottom = 0;
    double top = 1;
};

/// The cells of a stratified set in the order of its points: round(sqrt(count)) columns that share the cells as evenly
/// as whole numbers allow, the fuller ones first, each as wide as its share; so every cell has the area 1/count.
std::vector<Cell> cells(std::size_t count);

}  // namespace clerestory::reference
