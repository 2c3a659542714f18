#pragma OPENCL FP_CONTRACT OFF
#include "weight.clh"

/// Counts of every chunk of CHUNK_TEXELS texels of a row.
///   radiance [3 * height * width]  linear RGB, row-major, top row first
///   counts   [height * chunks]     chunks = ceil(width / CHUNK_TEXELS)
/// Range: one work-item per chunk. No local memory, no barrier. Exact.
kernel void count_chunks(global const float* radiance, uint width, uint chunks, uint items,
                         global TexelCounts* counts) {
    const uint item = (uint)get_global_id(0);
    if (item >= items) return;
    const uint first = item % chunks * CHUNK_TEXELS;
    const uint last = min(first + CHUNK_TEXELS, width);
    const global float* row = radiance + 3 * (size_t)width * (item / chunks);
    TexelCounts found = empty_counts(width);
    for (uint j = first; j < last; ++j) count_texel(&found, row[3 * j], row[3 * j + 1], row[3 * j + 2], j);
    counts[item] = found;
}

/// Counts of every row from that of its chunks.
///   row_counts [height]
/// Range: one work-item per row.
kernel void join_counts(global const TexelCounts* counts, uint width, uint chunks, uint height,
                        global TexelCounts* row_counts) {
    const uint row = (uint)get_global_id(0);
    if (row >= height) return;
    TexelCounts joined = empty_counts(width);
    for (uint c = 0; c < chunks; ++c) joined = joined_counts(joined, counts[(size_t)row * chunks + c]);
    row_counts[row] = joined;
}

/// Sum of the fixed-point intensities of every chunk, in its row's scale.
///   luminance  weights of R, G and B
///   weight     [height * chunks]
/// Range: one work-item per chunk. Exact but for the intensity's own rounding: at most 3.5 ulp (2 in 400,000 measured in
/// tests/stage1_weight_test.cpp), and half a unit of 2^-WEIGHT_BITS.
/// Source: Pharr, Jakob, Humphreys, PBRT 4th ed., 12.5, for the weight; the fixed point is this project's own.
kernel void sum_chunks(global const float* radiance, global const TexelCounts* row_counts, uint width, uint chunks,
                       uint items, float luminance_r, float luminance_g, float luminance_b, global RowWeight* weight) {
    const uint item = (uint)get_global_id(0);
    if (item >= items) return;
    const uint first = item % chunks * CHUNK_TEXELS;
    const uint last = min(first + CHUNK_TEXELS, width);
    const uint row_index = item / chunks;
    const global float* row = radiance + 3 * (size_t)width * row_index;
    const float3 luminance = (float3)(luminance_r, luminance_g, luminance_b);
    RowWeight sum;
    sum.sum = 0ul;
    sum.lit = 0u;
    sum.exponent = scale_exponent(row_counts[row_index].max_component);
    const float scale = power_of_two(-sum.exponent);
    const uint end = has_bad_texels(row_counts[row_index]) ? first : last;
    for (uint j = first; j < end; ++j) {
        const float r = row[3 * j];
        const float g = row[3 * j + 1];
        const float b = row[3 * j + 2];
        sum.sum += fixed_weight(scaled_intensity(r, g, b, scale, luminance));
        sum.lit += is_lit(r, g, b);
    }
    weight[item] = sum;
}

/// Weight of every row from that of its chunks.
/// Range: one work-item per row.
kernel void join_weights(global const RowWeight* weight, uint chunks, uint height, global RowWeight* row_weight) {
    const uint row = (uint)get_global_id(0);
    if (row >= height) return;
    RowWeight joined = weight[(size_t)row * chunks];
    for (uint c = 1; c < chunks; ++c) {
        joined.sum += weight[(size_t)row * chunks + c].sum;
        joined.lit += weight[(size_t)row * chunks + c].lit;
    }
    row_weight[row] = joined;
}
