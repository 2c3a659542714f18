#pragma OPENCL FP_CONTRACT OFF
#include "draw.clh"
#include "sequence.clh"

/// Samples that a work-item of draw_blocks draws.
#define DRAW_BLOCK 256u
/// Halvings that all of its searches take, of ranges below 2^QUICK_STEPS.
#define QUICK_STEPS 3

/// First element from `low` on whose end lies above `value`, in the table that starts at `base`, where high - low is below
/// 2^QUICK_STEPS. Indices are int, which gathers take as they are: no table has 2^31 words (ReadLimits of src/image.hpp).
INLINE int quick_halvings(global const uint* table, int base, int low, int high, uint value) {
#pragma unroll
    for (int step = QUICK_STEPS - 1; step >= 0; --step) {
        const int far = low + (1 << step) - 1;
        const int probe = far < high ? far : high;
        low = table[base + probe] <= value ? probe + 1 : low;
    }
    return low;
}

/// Start of element `index` of a table, which is word `at` of its buffer.
INLINE uint start_of(global const uint* table, int index, int at) {
    const uint end_before = table[index == 0 ? at : at - 1];
    return index == 0 ? 0u : end_before;
}

/// Writes the full record of one sample.
INLINE void store_sample(Tables tables, Point point, global const RowFrame* frames, global const float* radiance,
                         float inverse_width, float rotation, uint count, uint at, global uint* texel,
                         global float* direction, global float* pdf, global float* drawn) {
    const Draw draw = draw_texel(tables, point);
    const RowFrame frame = load_frame(frames, draw.row);
    const Direction towards = draw_direction(draw, frame, inverse_width, rotation);
    const size_t index = (size_t)draw.row * tables.width + draw.column;
    texel[at] = (uint)index;
    direction[at] = towards.x;
    direction[(size_t)count + at] = towards.y;
    direction[2 * (size_t)count + at] = towards.z;
    pdf[at] = draw_pdf(draw, frame);
    drawn[at] = radiance[3 * index];
    drawn[(size_t)count + at] = radiance[3 * index + 1];
    drawn[2 * (size_t)count + at] = radiance[3 * index + 2];
}

/// Draws points 2k and 2k + 1 of a sequence's stream, one pair a work-item.
///   texel     [count]      row * width + column
///   direction [3 * count]  three planes: x, y, z; unit length
///   pdf       [count]      per steradian
///   drawn     [3 * count]  three planes: radiance of the texel, R, G, B
/// Range: one work-item per pair. No local memory, no barrier.
/// Error: texels exact; place within the texel 2e-7 of it, the place's direction 6.5e-7 absolute, pdf 3 ulp (measured in
/// tests/stage3_sample_test.cpp, where the bounds are derived).
/// Source: Pharr, Jakob, Humphreys, PBRT 4th ed., 2.4 and 12.5; the integer tables are this project's own.
kernel void draw_samples(global const uint* marginal, global const uint* marginal_guide, uint height, uint row_bits,
                         global const uint* conditional, global const uint* conditional_guide, uint width,
                         uint column_bits, global const RowFrame* frames, global const float* radiance,
                         float inverse_width, float rotation, uint seed_low, uint seed_high, uint stream, Strata strata,
                         uint first, uint count, global uint* texel, global float* direction, global float* pdf,
                         global float* drawn) {
    const uint item = (uint)get_global_id(0);
    if (2u * item >= count) return;
    const Tables tables = {marginal, marginal_guide, conditional, conditional_guide, width, height, row_bits, column_bits};
    const PointPair points =
        sequence_points(seed_low, seed_high, DOMAIN_SHARED, stream, first / 2u + item, strata);
    store_sample(tables, points.even, frames, radiance, inverse_width, rotation, count, 2u * item, texel, direction, pdf,
                 drawn);
    if (2u * item + 1u >= count) return;
    store_sample(tables, points.odd, frames, radiance, inverse_width, rotation, count, 2u * item + 1u, texel, direction,
                 pdf, drawn);
}

#if GUIDED
/// As draw_samples, for a device whose vectors run along inner loops: a work-item draws DRAW_BLOCK samples in one short
/// loop after another, so that each is vectorised and many loads are under way at a time. Few draws need more than
/// QUICK_STEPS halvings; those get them one by one.
/// Range: one work-item per DRAW_BLOCK samples.
kernel void draw_blocks(global const uint* restrict marginal, global const uint* restrict marginal_guide, uint height,
                        uint row_bits, global const uint* restrict conditional,
                        global const uint* restrict conditional_guide, uint width, uint column_bits,
                        global const RowFrame* restrict frames, global const float* restrict radiance,
                        float inverse_width, float rotation, uint seed_low, uint seed_high, uint stream, Strata strata,
                        uint first, uint count, global uint* restrict texel, global float* restrict direction,
                        global float* restrict pdf, global float* restrict drawn) {
    const uint begin = DRAW_BLOCK * (uint)get_global_id(0);
    if (begin >= count) return;
    const int here = (int)least(DRAW_BLOCK, count - begin);
    uint u_row[DRAW_BLOCK], u_column[DRAW_BLOCK];
    int row[DRAW_BLOCK], column[DRAW_BLOCK];
    uint end[DRAW_BLOCK];
    for (uint k = 0u; k < DRAW_BLOCK / 2u; ++k) {
        const PointPair points =
            sequence_points(seed_low, seed_high, DOMAIN_SHARED, stream, (first + begin) / 2u + k, strata);
        u_row[2u * k] = points.even.x;
        u_row[2u * k + 1u] = points.odd.x;
        u_column[2u * k] = points.even.y;
        u_column[2u * k + 1u] = points.odd.y;
    }
    for (int k = 0; k < DRAW_BLOCK; ++k) {
        const uint value = u_row[k] >> (32 - TABLE_BITS);
        const int start = (int)marginal_guide[value >> (TABLE_BITS - row_bits)];
        row[k] = quick_halvings(marginal, 0, start, (int)height - 1, value);
        end[k] = marginal[row[k]];
    }
#pragma clang loop vectorize(disable)
    for (int k = 0; k < DRAW_BLOCK; ++k) {
        const uint value = u_row[k] >> (32 - TABLE_BITS);
        if (end[k] > value) continue;
        row[k] = (int)bisect(marginal, (uint)row[k] + 1u, height - 1u, value, ROW_STEPS);
    }
    const int entries = (int)(1u << column_bits) + 1;
    for (int k = 0; k < DRAW_BLOCK; ++k) {
        const uint entry = u_column[k] >> (32 - TABLE_BITS) >> (TABLE_BITS - column_bits);
        column[k] = (int)conditional_guide[row[k] * entries + (int)entry];
    }
    for (int k = 0; k < DRAW_BLOCK; ++k) {
        const uint value = u_column[k] >> (32 - TABLE_BITS);
        column[k] = quick_halvings(conditional, row[k] * (int)width, column[k], (int)width - 1, value);
        end[k] = conditional[row[k] * (int)width + column[k]];
    }
#pragma clang loop vectorize(disable)
    for (int k = 0; k < DRAW_BLOCK; ++k) {
        const uint value = u_column[k] >> (32 - TABLE_BITS);
        if (end[k] > value) continue;
        global const uint* ends = conditional + row[k] * (int)width;
        column[k] = (int)bisect(ends, (uint)column[k] + 1u, width - 1u, value, COLUMN_STEPS);
    }
    global const float* restrict frame_fields = (global const float*)frames;
    for (int k = 0; k < here; ++k) {
        const int i = row[k];
        const int j = column[k];
        const int at = i * (int)width + j;
        Draw draw;
        draw.row = (uint)i;
        draw.column = (uint)j;
        place_within(&draw, u_row[k], u_column[k], start_of(marginal, i, i), marginal[i], start_of(conditional, j, at),
                     conditional[at]);
        RowFrame frame;
        frame.cap = frame_fields[4 * i];
        frame.cap_step = frame_fields[4 * i + 1];
        frame.pole = i <= (int)height - 1 - i ? 1.0f : -1.0f;
        frame.solid_angle = frame_fields[4 * i + 3];
        const Direction towards = draw_direction(draw, frame, inverse_width, rotation);
        texel[begin + k] = (uint)at;
        direction[begin + k] = towards.x;
        direction[(size_t)count + begin + k] = towards.y;
        direction[2 * (size_t)count + begin + k] = towards.z;
        pdf[begin + k] = draw_pdf(draw, frame);
    }
    for (int k = 0; k < here; ++k) {
        const int at = 3 * (row[k] * (int)width + column[k]);
        drawn[begin + k] = radiance[at];
        drawn[(size_t)count + begin + k] = radiance[at + 1];
        drawn[2 * (size_t)count + begin + k] = radiance[at + 2];
    }
}
#endif

/// The texel and the place within it of given points, for tests of every boundary.
///   u      [2 * count]  pairs of 32-bit fractions
///   texel  [count]
///   within [2 * count]  pairs: of the way down the row, along the column
/// Range: one work-item per point.
kernel void locate_points(global const uint* marginal, global const uint* marginal_guide, uint height, uint row_bits,
                          global const uint* conditional, global const uint* conditional_guide, uint width,
                          uint column_bits, global const uint* u, uint count, global uint* texel,
                          global float* within) {
    const uint at = (uint)get_global_id(0);
    if (at >= count) return;
    const Tables tables = {marginal, marginal_guide, conditional, conditional_guide, width, height, row_bits, column_bits};
    const Point point = {u[2 * at], u[2 * at + 1]};
    const Draw draw = draw_texel(tables, point);
    texel[at] = draw.row * width + draw.column;
    within[2 * at] = draw.down;
    within[2 * at + 1] = draw.along;
}
