#pragma OPENCL FP_CONTRACT OFF
#include "sequence.clh"

/// Philox4x32-10 of given counters and keys, for its known answers.
///   counter [4 * count]
///   key     [2 * count]
///   words   [4 * count]
/// Range: one work-item per counter.
kernel void philox_words(global const uint* counter, global const uint* key, uint count, global uint* words) {
    const uint at = (uint)get_global_id(0);
    if (at >= count) return;
    const Words from = {counter[4 * at], counter[4 * at + 1], counter[4 * at + 2], counter[4 * at + 3]};
    const Words to = philox4x32_10(from, key[2 * at], key[2 * at + 1]);
    words[4 * at] = to.x;
    words[4 * at + 1] = to.y;
    words[4 * at + 2] = to.z;
    words[4 * at + 3] = to.w;
}

/// Points of one stream, as the drawing kernels see them: for tests, and to time the sequences alone.
///   point [4 * pairs]  two 32-bit fractions a point
/// Range: one work-item per pair of points. No local memory, no barrier.
kernel void write_points(uint seed_low, uint seed_high, uint domain, uint stream, Strata strata, uint first_pair,
                         uint pairs, global uint* point) {
    const uint item = (uint)get_global_id(0);
    if (item >= pairs) return;
    const PointPair points = sequence_points(seed_low, seed_high, domain, stream, first_pair + item, strata);
    point[4 * item] = points.even.x;
    point[4 * item + 1] = points.even.y;
    point[4 * item + 2] = points.odd.x;
    point[4 * item + 3] = points.odd.y;
}
