#include "ceilings.hpp"

#include <algorithm>
#include <array>
#include <barrier>
#include <cstdint>
#include <cstring>
#include <map>
#include <thread>
#include <vector>

#include "image.hpp"
#include "processor_time.hpp"

namespace clerestory::bench {
namespace {

constexpr int RUNS = 5;

/// Results go here, so that compilers cannot leave the work out.
volatile std::uint64_t sink;

/// Work a second of `cores` threads that each do `work(thread)`, an amount of `amount`, RUNS times; the best of the
/// runs.
template <class Work>
double best_rate(unsigned cores, double amount, Work work) {
    std::vector<double> seconds(cores);
    double best = 0;
    std::barrier start(cores);
    std::barrier end(cores, [&]() noexcept {
        double rate = 0;
        for (const double each : seconds) rate += amount / each;
        best = std::max(best, rate);
    });
    const auto run = [&](unsigned thread) {
        for (int i = 0; i < RUNS; ++i) {
            start.arrive_and_wait();
            const double before = thread_seconds();
            work(thread);
            seconds[thread] = thread_seconds() - before;
            end.arrive_and_wait();
        }
    };
    {
        std::vector<std::jthread> others;
        for (unsigned thread = 1; thread < cores; ++thread) others.emplace_back(run, thread);
        run(0);
    }
    return best;
}

std::uint64_t scrambled(std::uint64_t x) {
    x = (x ^ (x >> 31)) * 0x9E3779B97F4A7C15U;
    return x ^ (x >> 29);
}

}  // namespace

double copy_bandwidth(unsigned cores) {
    constexpr std::size_t FLOATS = std::size_t{48} << 20;  // 192 MiB
    static PageBuffer from(FLOATS);
    static PageBuffer to(FLOATS);
    static const bool touched = [] {
        std::fill_n(from.data(), FLOATS, 1.0F);
        std::fill_n(to.data(), FLOATS, 2.0F);
        return true;
    }();
    const std::size_t part = FLOATS / cores;
    const auto bytes = static_cast<double>(2 * part * sizeof(float));
    return best_rate(cores, touched ? bytes : 0, [&](unsigned thread) {
        std::memcpy(to.data() + thread * part, from.data() + thread * part, part * sizeof(float));
    });
}

double multiply_add_rate(unsigned cores) {
    using Vector [[gnu::vector_size(64)]] = float;
    constexpr std::size_t LANES = 16;
    constexpr std::size_t SUMS = 16;  // more than an fma's latency times its units
    constexpr std::size_t STEPS = std::size_t{1} << 20;
    return best_rate(cores, 2.0 * static_cast<double>(LANES * SUMS * STEPS), [&](unsigned thread) {
        std::array<Vector, SUMS> sums{};
        for (std::size_t i = 0; i < SUMS; ++i) sums[i] += static_cast<float>(i + thread);
        const Vector factor = Vector{} + (0.5F + static_cast<float>(sink) * 0x1p-20F);
        for (std::size_t step = 0; step < STEPS; ++step) {
#pragma GCC unroll 16
            for (std::size_t i = 0; i < SUMS; ++i) sums[i] = sums[i] * factor + factor;
        }
        Vector total{};
        for (const Vector& sum : sums) total += sum;
        sink = static_cast<std::uint64_t>(total[0]);
    });
}

double gather_rate(unsigned cores, std::size_t bytes) {
    constexpr std::size_t LOADS = std::size_t{1} << 21;
    static std::map<std::size_t, PageBuffer> tables;
    static std::vector<std::uint32_t> places;
    const std::size_t words = std::max<std::size_t>(bytes / sizeof(float), 1);
    auto [found, fresh] = tables.try_emplace(words, words);
    if (fresh) std::fill_n(found->second.data(), words, 1.0F);
    places.resize(LOADS * cores);
    for (std::size_t i = 0; i < places.size(); ++i) {
        places[i] = static_cast<std::uint32_t>(((scrambled(i) >> 32) * words) >> 32);
    }
    const float* table = found->second.data();
    return best_rate(cores, static_cast<double>(LOADS), [&](unsigned thread) {
        constexpr std::size_t SUMS = 64;
        std::array<float, SUMS> sums{};
        const std::uint32_t* at = places.data() + thread * LOADS;
        for (std::size_t i = 0; i < LOADS; i += SUMS) {
            for (std::size_t k = 0; k < SUMS; ++k) sums[k] += table[at[i + k]];
        }
        float total = 0;
        for (const float sum : sums) total += sum;
        sink = static_cast<std::uint64_t>(total);
    });
}

}  // namespace clerestory::bench
