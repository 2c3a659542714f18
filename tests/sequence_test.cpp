#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <numbers>
#include <set>
#include <vector>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"
#include "reference/sequence.hpp"
#include "sampling/stage3_sample.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

using test::TestDevice;

using Fraction = std::uint32_t;
using FractionPair = std::array<Fraction, 2>;

constexpr double ONE = 4294967296.0;  // a fraction's unit is 1/ONE

/// Standard errors that a seeded test may be off by: by chance one in 150,000 is further out, so that all checks of
/// this file together would fail for fewer than one seed in fifty.
constexpr double SIGMAS = 4.5;

/// As SIGMAS for the worst of tens of thousands of numbers: by chance one in two billion.
constexpr double SIGMAS_OF_WORST = 6;

struct Stream {
    std::uint64_t seed = 1;
    cl_uint domain = DOMAIN_SHARED;
    cl_uint number = 0;
};

/// Points as the kernels give them.
class Points {
  public:
    Points(const Device& device, Sequence sequence)
        : device_(device),
          program_(device, "sequence.cl", fmt::format("-DSEQUENCE={}u", static_cast<cl_uint>(sequence))),
          write_points_(device, program_, "write_points") {}

    /// Points first .. first + count - 1 of a set of `total`; `first` is even.
    std::vector<FractionPair> operator()(std::size_t count, const Stream& stream = {}, std::size_t first = 0,
                                         std::size_t total = 0, std::size_t group = 64) {
        const std::size_t pairs = (count + 1) / 2;
        Buffer<cl_uint> point(device_, "the points", 4 * pairs);
        write_points_({pairs, group}, static_cast<cl_uint>(stream.seed), static_cast<cl_uint>(stream.seed >> 32),
                      stream.domain, stream.number, strata(total == 0 ? first + count : total),
                      static_cast<cl_uint>(first / 2), static_cast<cl_uint>(pairs), point);
        const std::vector<cl_uint> flat = point.download();
        std::vector<FractionPair> out(count);
        for (std::size_t i = 0; i < count; ++i) out[i] = {flat[2 * i], flat[2 * i + 1]};
        return out;
    }

  private:
    const Device& device_;
    Program program_;
    Kernel<cl_uint, cl_uint, cl_uint, cl_uint, Strata, cl_uint, cl_uint, Buffer<cl_uint>> write_points_;
};

class SequenceSuite : public testing::Test {
  protected:
    TestDevice device_;
};

using SequencePhilox = SequenceSuite;
using SequenceSobol = SequenceSuite;
using SequenceStratified = SequenceSuite;

class SequenceAny : public testing::TestWithParam<Sequence> {
  protected:
    TestDevice device_;
    Points points_{device_, GetParam()};
};

std::string sequence_name(const testing::TestParamInfo<Sequence>& info) {
    return std::array{"Random", "Stratified", "Sobol"}.at(static_cast<std::size_t>(info.param));
}

INSTANTIATE_TEST_SUITE_P(All, SequenceAny, testing::Values(Sequence::random, Sequence::stratified, Sequence::sobol),
                         sequence_name);

double fraction(Fraction f) { return (static_cast<double>(f) + 0.5) / ONE; }

/// Known answers of Random123 1.09, file kat_vectors: counter, key, words.
TEST_F(SequencePhilox, GivesThePublishedAnswers) {
    const std::vector<cl_uint> counter = {0U,          0U,          0U,          0U,          0xffffffffU, 0xffffffffU,
                                          0xffffffffU, 0xffffffffU, 0x243f6a88U, 0x85a308d3U, 0x13198a2eU, 0x03707344U};
    const std::vector<cl_uint> key = {0U, 0U, 0xffffffffU, 0xffffffffU, 0xa4093822U, 0x299f31d0U};
    const std::vector<cl_uint> words = {0x6627e8d5U, 0xe169c58dU, 0xbc57ac4cU, 0x9b00dbd8U, 0x408f276dU, 0x41c83b0eU,
                                        0xa20bc7c6U, 0x6d5451fdU, 0xd16cfe09U, 0x94fdccebU, 0x5001e420U, 0x24126ea1U};
    const Program program(device_, "sequence.cl");
    Kernel<Buffer<cl_uint>, Buffer<cl_uint>, cl_uint, Buffer<cl_uint>> philox(device_, program, "philox_words");
    const Buffer<cl_uint> counters(device_, "the counters", std::span(counter));
    const Buffer<cl_uint> keys(device_, "the keys", std::span(key));
    Buffer<cl_uint> out(device_, "the words", words.size());
    philox({3, 1}, counters, keys, 3U, out);
    EXPECT_EQ(out.download(), words);
    for (std::size_t i = 0; i < 3; ++i) {
        const auto host = reference::philox4x32_10(
            {counter[4 * i], counter[4 * i + 1], counter[4 * i + 2], counter[4 * i + 3]}, {key[2 * i], key[2 * i + 1]});
        EXPECT_THAT(host, testing::ElementsAreArray(words.begin() + static_cast<std::ptrdiff_t>(4 * i),
                                                    words.begin() + static_cast<std::ptrdiff_t>(4 * i + 4)));
    }
}

/// Random points are Philox's words of (pair, stream, domain, sequence) in that order; two of them a point.
TEST_F(SequencePhilox, RandomPointsAreItsWords) {
    Points points(device_, Sequence::random);
    const Stream stream{0x123456789abcdef0U, DOMAIN_PER_PIXEL, 77};
    const auto drawn = points(1001, stream, 2000, 4001);
    for (std::size_t i = 0; i < drawn.size(); ++i) {
        const auto words = reference::philox4x32_10({static_cast<cl_uint>((2000 + i) / 2), 77, DOMAIN_PER_PIXEL, 0},
                                                    {0x9abcdef0U, 0x12345678U});
        const std::size_t half = 2 * (i % 2);
        ASSERT_EQ(drawn[i], (FractionPair{words[half], words[half + 1]})) << "point " << i;
    }
}

/// The same points for any work-group size, and whether drawn at once or in batches.
TEST_P(SequenceAny, HasTheSameBitsForAnyGroupAndBatch) {
    constexpr std::size_t COUNT = 1531;
    const auto whole = points_(COUNT);
    for (const std::size_t group : {1U, 3U, 16U, 256U}) EXPECT_EQ(points_(COUNT, {}, 0, 0, group), whole) << group;
    std::vector<FractionPair> joined;
    for (const auto& [first, count] : {std::pair<std::size_t, std::size_t>{0, 64}, {64, 1000}, {1064, 467}}) {
        const auto batch = points_(count, {}, first, COUNT);
        joined.insert(joined.end(), batch.begin(), batch.end());
    }
    EXPECT_EQ(joined, whole);
}

/// Each dimension of a point is uniform: points j of many streams fall into bins evenly.
TEST_P(SequenceAny, IsUniformInEachDimension) {
    constexpr std::size_t COUNT = 12;
    constexpr std::size_t STREAMS = 1024;
    constexpr std::size_t BINS = 64;
    // A chi-square of k degrees of freedom has mean k and variance 2k; its right tail is heavier than a normal one's,
    // which the sixth sigma allows for.
    const double bound = (BINS - 1) + SIGMAS_OF_WORST * std::sqrt(2.0 * (BINS - 1));
    std::array<std::array<double, BINS>, 2> bins{};
    for (cl_uint stream = 0; stream < STREAMS; ++stream) {
        for (const auto& point : points_(COUNT, {3, DOMAIN_PER_PIXEL, stream})) {
            for (std::size_t d = 0; d < 2; ++d) bins.at(d).at(point[d] >> 26) += 1;
        }
    }
    constexpr double EXPECTED = static_cast<double>(COUNT * STREAMS) / BINS;
    for (std::size_t d = 0; d < 2; ++d) {
        double chi_square = 0;
        for (const double n : bins.at(d)) chi_square += (n - EXPECTED) * (n - EXPECTED) / EXPECTED;
        EXPECT_LT(chi_square, bound) << "dimension " << d;
    }
}

/// Streams, domains and seeds are independent: the products of two sets' points, one by one, average to nothing.
TEST_P(SequenceAny, DiffersIndependentlyBetweenStreamsDomainsAndSeeds) {
    constexpr std::size_t COUNT = 16;
    constexpr std::size_t SETS = 1024;
    const std::vector<std::pair<const char*, std::function<Stream(cl_uint)>>> others = {
        {"next stream",
         [](cl_uint s) {
             return Stream{5, DOMAIN_PER_PIXEL, s + 1};
         }},
        {"stream a row on",
         [](cl_uint s) {
             return Stream{5, DOMAIN_PER_PIXEL, s + 511};
         }},
        {"domain",
         [](cl_uint s) {
             return Stream{5, DOMAIN_SHARED, s};
         }},
        {"seed",
         [](cl_uint s) {
             return Stream{6, DOMAIN_PER_PIXEL, s};
         }},
        {"seed's high word", [](cl_uint s) {
             return Stream{(1ULL << 32) + 5, DOMAIN_PER_PIXEL, s};
         }}};
    for (const auto& [name, other] : others) {
        for (std::size_t of = 0; of < 2; ++of) {
            double sum = 0;
            for (cl_uint s = 0; s < SETS; ++s) {
                const auto here = points_(COUNT, {5, DOMAIN_PER_PIXEL, s});
                const auto there = points_(COUNT, other(s));
                // A point's place in its own stratum, of 4x4: what all stratified sets share by design does not count.
                for (std::size_t i = 0; i < COUNT; ++i) {
                    const auto low = [](Fraction f) { return fraction(f << 2) - 0.5; };
                    sum += low(here[i][of]) * low(there[i][of]);
                    sum += low(here[i][of]) * low(there[i][1 - of]);
                }
            }
            // Each product of two uniforms on (-1/2, 1/2) has variance 1/144; the pairs of one set may share a factor
            // and, scrambled alike, a sign, at most COUNT alike: the sum's deviation is below this.
            const double deviation = std::sqrt(2.0 * COUNT * COUNT * SETS / 144);
            EXPECT_LT(std::abs(sum), SIGMAS * deviation) << name << ", dimension " << of;
        }
    }
}

/// Joe and Kuo's initial numbers give m = 1, 3, 5, 15, 17, 51, 85, 255 and the first eight points of the plane.
TEST(SequenceReference, SobolHasThePublishedPoints) {
    const auto v = reference::direction_numbers(2);
    const std::array<std::uint32_t, 8> m = {1, 3, 5, 15, 17, 51, 85, 255};
    for (std::size_t k = 0; k < m.size(); ++k) EXPECT_EQ(v.at(k) >> (31 - k), m.at(k)) << k;
    const std::array<std::array<double, 2>, 8> published = {
        {{0, 0}, {.5, .5}, {.25, .75}, {.75, .25}, {.125, .625}, {.625, .125}, {.375, .375}, {.875, .875}}};
    for (std::uint32_t i = 0; i < published.size(); ++i) {
        for (std::size_t d = 0; d < 2; ++d) {
            EXPECT_EQ(reference::sobol_point(i)[d], published.at(i).at(d) * ONE) << i << ", dimension " << d;
        }
    }
}

/// Two scrambled points agree in their first digits exactly as long as Sobol's own do: that makes it a nested scramble
/// of that sequence, whatever the hash. Checked in every 32-bit digit, far out in the sequence too.
TEST_F(SequenceSobol, IsTheReferenceWithTheDigitsOfATreeFlipped) {
    Points points(device_, Sequence::sobol);
    for (const std::size_t first : {std::size_t{0}, std::size_t{0x7ffffc00}}) {
        const auto drawn = points(512, {9, DOMAIN_SHARED, 4}, first);
        for (std::size_t d = 0; d < 2; ++d) {
            for (std::size_t i = 0; i < drawn.size(); ++i) {
                for (std::size_t j = 0; j < i; ++j) {
                    const Fraction own = reference::sobol_point(static_cast<std::uint32_t>(first + i))[d] ^
                                         reference::sobol_point(static_cast<std::uint32_t>(first + j))[d];
                    ASSERT_EQ(std::countl_zero(drawn[i][d] ^ drawn[j][d]), std::countl_zero(own))
                        << "points " << i << " and " << j << " from " << first << ", dimension " << d;
                }
            }
        }
    }
}

/// Every aligned run of 2^k points is a (0,k,2)-net: one point in each of the 2^k boxes of any shape of area 2^-k.
TEST_F(SequenceSobol, EveryRunOfAPowerOfTwoIsANet) {
    Points points(device_, Sequence::sobol);
    constexpr unsigned MOST = 14;
    const auto drawn = points(std::size_t{1} << MOST, {11, DOMAIN_SHARED, 0});
    for (unsigned k = 0; k <= MOST; ++k) {
        const std::size_t run = std::size_t{1} << k;
        for (std::size_t first = 0; first < drawn.size(); first += std::max<std::size_t>(run, 1024)) {
            for (unsigned across = 0; across <= k; ++across) {
                std::vector<int> box(run, 0);
                for (std::size_t i = first; i < first + run; ++i) {
                    const std::uint64_t column = std::uint64_t{drawn[i][0]} >> (32 - across);
                    const std::uint64_t row = std::uint64_t{drawn[i][1]} >> (32 - (k - across));
                    ++box[(column << (k - across)) + row];
                }
                ASSERT_THAT(box, testing::Each(1)) << "2^" << k << " points from " << first << ", 2^" << across;
            }
        }
    }
}

/// The coins of the tree's first nodes are fair and independent of each other, between depths, branches and dimensions.
TEST_F(SequenceSobol, CoinsOfTheTreeAreFairAndIndependent) {
    Points points(device_, Sequence::sobol);
    constexpr std::size_t DEPTH = 5;                        // nodes in the first five digits: 31 a dimension
    constexpr std::size_t DEEP = 27;                        // and single coins further down, of point 0
    constexpr std::size_t NODES = (1 << DEPTH) - 1 + DEEP;  // a dimension
    constexpr std::size_t STREAMS = 4096;
    std::vector<std::array<int, 2 * NODES>> coins(STREAMS);
    for (cl_uint s = 0; s < STREAMS; ++s) {
        const auto drawn = points(std::size_t{1} << DEPTH, {2, DOMAIN_PER_PIXEL, s});
        for (std::size_t d = 0; d < 2; ++d) {
            for (std::uint32_t i = 0; i < drawn.size(); ++i) {
                const Fraction own = reference::sobol_point(i)[d];
                const Fraction flips = own ^ drawn[i][d];
                std::size_t node = 0;
                for (unsigned digit = 0; digit < DEPTH; ++digit) {
                    coins[s].at(d * NODES + node) = (flips >> (31 - digit) & 1U) != 0 ? 1 : -1;
                    node = 2 * node + 1 + (own >> (31 - digit) & 1U);
                }
            }
            const Fraction flips = drawn[0][d];  // point 0 is the origin
            for (unsigned digit = DEPTH; digit < 32; ++digit) {
                coins[s].at(d * NODES + (1 << DEPTH) - 1 + digit - DEPTH) = (flips >> (31 - digit) & 1U) != 0 ? 1 : -1;
            }
        }
    }
    const double bound = SIGMAS_OF_WORST * std::sqrt(static_cast<double>(STREAMS));
    for (std::size_t a = 0; a < 2 * NODES; ++a) {
        int sum = 0;
        for (const auto& coin : coins) sum += coin[a];
        EXPECT_LT(std::abs(sum), bound) << "node " << a;
        for (std::size_t b = 0; b < a; ++b) {
            int both = 0;
            for (const auto& coin : coins) both += coin[a] * coin[b];
            EXPECT_LT(std::abs(both), bound) << "nodes " << a << " and " << b;
        }
    }
}

struct Moments {
    double mean = 0;
    double variance = 0;
    double variance_error = 0;  ///< standard error of the variance
};

Moments moments(const std::vector<double>& values) {
    const auto n = static_cast<double>(values.size());
    Moments m;
    for (const double v : values) m.mean += v / n;
    double fourth = 0;
    for (const double v : values) {
        const double square = (v - m.mean) * (v - m.mean);
        m.variance += square / n;
        fourth += square * square / n;
    }
    m.variance_error = std::sqrt((fourth - m.variance * m.variance) / n);
    return m;
}

/// The hash does what a true Owen scramble does: on smooth and broken integrands the mean is the integral and the
/// variance that of a tree whose every coin is drawn on its own.
TEST_F(SequenceSobol, HasTheVarianceOfAnExplicitTree) {
    struct Integrand {
        const char* name;
        std::function<double(double, double)> value;
        double integral;
    };
    const std::vector<Integrand> integrands = {
        {"bilinear", [](double x, double y) { return x * y; }, 0.25},
        {"smooth", [](double x, double y) { return std::exp(x - 2 * y); },
         (std::numbers::e - 1) * (1 - std::exp(-2.0)) / 2},
        {"disc", [](double x, double y) { return x * x + y * y < 1 ? 1.0 : 0.0; }, std::numbers::pi / 4},
        {"step", [](double x, double y) { return x + y < 0.7 ? 1.0 : 0.0; }, 0.245}};
    Points points(device_, Sequence::sobol);
    constexpr std::size_t SETS = 1024;
    for (const std::size_t count : {16U, 128U}) {
        std::vector<std::vector<double>> hashed(integrands.size(), std::vector<double>(SETS));
        std::vector<std::vector<double>> explicitly = hashed;
        for (std::size_t s = 0; s < SETS; ++s) {
            const auto drawn = points(count, {1, DOMAIN_PER_PIXEL, static_cast<cl_uint>(s)});
            reference::OwenTree trees[2] = {reference::OwenTree(2 * s), reference::OwenTree(2 * s + 1)};
            for (std::size_t i = 0; i < count; ++i) {
                const auto own = reference::sobol_point(static_cast<std::uint32_t>(i));
                const FractionPair scrambled = {trees[0].scrambled(own[0]), trees[1].scrambled(own[1])};
                for (std::size_t f = 0; f < integrands.size(); ++f) {
                    const auto& value = integrands[f].value;
                    hashed[f][s] += value(fraction(drawn[i][0]), fraction(drawn[i][1])) / static_cast<double>(count);
                    explicitly[f][s] +=
                        value(fraction(scrambled[0]), fraction(scrambled[1])) / static_cast<double>(count);
                }
            }
        }
        for (std::size_t f = 0; f < integrands.size(); ++f) {
            const Moments kernel = moments(hashed[f]);
            const Moments tree = moments(explicitly[f]);
            EXPECT_NEAR(kernel.mean, integrands[f].integral, SIGMAS * std::sqrt(kernel.variance / SETS))
                << integrands[f].name << ", " << count << " points";
            EXPECT_NEAR(kernel.variance, tree.variance, SIGMAS * std::hypot(kernel.variance_error, tree.variance_error))
                << integrands[f].name << ", " << count << " points";
        }
    }
}

/// Each point lies in its own cell, cells have equal areas, and the place in the cell is uniform, for squares and not.
TEST_F(SequenceStratified, HasOnePointInEachCell) {
    Points points(device_, Sequence::stratified);
    // fraction_of_line() rounds down twice, and a fraction stands for the middle of its unit.
    constexpr double ROUNDING = 2.5 / ONE;
    for (const std::size_t count :
         {1U, 2U, 3U, 5U, 7U, 12U, 13U, 32U, 64U, 99U, 100U, 101U, 1000U, 1021U, 1024U, 16384U, 65537U}) {
        const auto drawn = points(count);
        const auto cells = reference::cells(count);
        ASSERT_EQ(cells.size(), count);
        for (std::size_t k = 0; k < count; ++k) {
            const auto& cell = cells[k];
            ASSERT_NEAR((cell.right - cell.left) * (cell.top - cell.bottom) * static_cast<double>(count), 1, 1e-9);
            const double x = fraction(drawn[k][0]);
            const double y = fraction(drawn[k][1]);
            ASSERT_TRUE(x > cell.left - ROUNDING && x < cell.right + ROUNDING) << x << ": " << k << " of " << count;
            ASSERT_TRUE(y > cell.bottom - ROUNDING && y < cell.top + ROUNDING) << y << ": " << k << " of " << count;
        }
    }
}

TEST_F(SequenceStratified, IsUniformWithinItsCells) {
    Points points(device_, Sequence::stratified);
    constexpr std::size_t COUNT = 65536;
    constexpr std::size_t BINS = 16;  // a side
    std::vector<double> bins(BINS * BINS, 0.0);
    const auto drawn = points(COUNT);
    const auto cells = reference::cells(COUNT);
    for (std::size_t k = 0; k < COUNT; ++k) {
        const double x = (fraction(drawn[k][0]) - cells[k].left) / (cells[k].right - cells[k].left);
        const double y = (fraction(drawn[k][1]) - cells[k].bottom) / (cells[k].top - cells[k].bottom);
        bins.at(static_cast<std::size_t>(x * BINS) * BINS + static_cast<std::size_t>(y * BINS)) += 1;
    }
    double chi_square = 0;
    constexpr double EXPECTED = static_cast<double>(COUNT) / (BINS * BINS);
    for (const double n : bins) chi_square += (n - EXPECTED) * (n - EXPECTED) / EXPECTED;
    const double freedom = BINS * BINS - 1;
    EXPECT_LT(std::abs(chi_square - freedom), SIGMAS_OF_WORST * std::sqrt(2 * freedom));
}

/// The largest set: its last point lies in the last column's last cell, so nothing overflowed on the way.
TEST_F(SequenceStratified, ReachesTheCornerOfTheLargestSet) {
    Points points(device_, Sequence::stratified);
    constexpr std::size_t COUNT = (std::size_t{1} << 31) - 1;
    constexpr double CELLS = 46340;  // 46341 columns of 46341 or 46340 cells
    const auto last = points(1, {}, COUNT - 1, COUNT).front();
    EXPECT_GT(fraction(last[0]), 1 - CELLS / static_cast<double>(COUNT) - 2 / ONE);
    EXPECT_GT(fraction(last[1]), 1 - 1 / CELLS - 2 / ONE);
}

}  // namespace
}  // namespace clerestory
