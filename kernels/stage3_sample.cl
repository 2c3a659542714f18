#pragma OPENCL FP_CONTRACT OFF
#include "draw.clh"
#include "sequence.clh"

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
