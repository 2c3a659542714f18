#pragma once

#include <cstddef>

namespace clerestory::bench {

/// What this machine can do at most, a second, measured by host loops of the plainest kind: one thread a core, best of
/// several runs. Seconds are of processor time, so that other programs on the machine do not count. Each call measures
/// anew, in about a tenth of a second, so that a benchmark can ask right before and after its own runs.

/// Bytes read and written by memcpy between arrays that no cache holds.
double copy_bandwidth(unsigned cores);

/// Floating-point operations of independent fused multiply-adds, two for each.
double multiply_add_rate(unsigned cores);

/// Loads of 32-bit words from random places of a table of `bytes`, places known beforehand.
double gather_rate(unsigned cores, std::size_t bytes);

}  // namespace clerestory::bench
