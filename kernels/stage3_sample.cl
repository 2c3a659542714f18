#pragma OPENCL FP_CONTRACT OFF
#include "draw.clh"
#include "sequence.clh"

/// Samples that a work-item of draw_blocks draws.
#define DRAW_BLOCK 256
/// Halvings that all of its searches of columns take, of ranges below 2^QUICK_STEPS.
#define QUICK_STEPS 3
/// Fields of a record: texel, x, y, z, pdf, R, G, B.
#define RECORD_FIELDS 8
/// Sets of so many samples go past the caches: no cache keeps their records until they are read.
#define STREAMED_COUNT (1u << 18)
/// Floats of a cache line.
#define LINE 16

/// Writes a line of `to`, whole and aligned, without reading it first. What a work-group leaves on its way to memory is
/// there when the driver hands the group over, which takes a locked instruction.
#if STREAMING_STORES
#define STREAM_LINE(line, to) __builtin_nontemporal_store(line, (global float16*)(to))
#else
#define STREAM_LINE(line, to) vstore16(line, 0, to)
#endif

/// One loop over the block's samples. Two vectors at a time hide more of what a load waits for.
#define EACH_SAMPLE _Pragma("clang loop interleave_count(2)") for (int k = 0; k < DRAW_BLOCK; ++k)
/// Which samples need more than the rest, a byte each, or eight at a time.
typedef union {
    uchar each[DRAW_BLOCK];
    ulong eight[DRAW_BLOCK / 8];
} Marks;
/// The same for what few samples need: eights without a mark in `unresolved` are passed over.
#define UNRESOLVED_SAMPLES                                                      \
    _Pragma("clang loop vectorize(disable)") for (int e = 0; e < DRAW_BLOCK / 8; ++e) \
        if (unresolved.eight[e] != 0ul)                                               \
            _Pragma("clang loop vectorize(disable)") for (int k = 8 * e; k < 8 * e + 8; ++k)

/// One halving of the elements from `low` to `high` of the table that starts at `base`: whether the element lies above the
/// first 2^step - 1. The end of `high` lies above `value`, so it is never passed. Indices are int, which gathers take as
/// they are: no table has 2^31 words (ReadLimits of include/clerestory/image.hpp).
INLINE int quick_halving(global const uint* table, int base, int low, int high, uint value, int step) {
    const int far = low + (1 << step) - 1;
    const int probe = far < high ? far : high;
    return table[base + probe] <= value ? probe + 1 : low;
}

/// Start of element `index` of a table, which is word `at` of its buffer.
INLINE uint start_of(global const uint* table, int index, int at) {
    const uint end_before = table[index == 0 ? at : at - 1];
    return index == 0 ? 0u : end_before;
}

/// Writes the full record of one sample.
INLINE void store_sample(Tables tables, Point point, global const RowFrame* frames, global const float* radiance,
                         DrawSettings by, uint count, uint at, global uint* texel, global float* direction,
                         global float* pdf, global float* drawn) {
    const Draw draw = draw_texel(tables, point);
    const RowFrame frame = load_frame(frames, draw.row);
    const Direction towards = draw_direction(draw, frame, by.inverse_width, by.rotation);
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
kernel void draw_samples(global const uint* marginal, global const uint* marginal_guide,
                         global const uint* conditional, global const uint* conditional_guide,
                         global const RowFrame* frames, global const float* radiance, DrawSettings by, uint first,
                         uint count, global uint* texel, global float* direction, global float* pdf,
                         global float* drawn) {
    const uint item = (uint)get_global_id(0);
    if (2u * item >= count) return;
    const Tables tables = tables_of(marginal, marginal_guide, conditional, conditional_guide, by);
    const PointPair points =
        sequence_points(by.seed_low, by.seed_high, DOMAIN_SHARED, 0u, first / 2u + item, by.strata);
    store_sample(tables, points.even, frames, radiance, by, count, 2u * item, texel, direction, pdf, drawn);
    if (2u * item + 1u >= count) return;
    store_sample(tables, points.odd, frames, radiance, by, count, 2u * item + 1u, texel, direction, pdf, drawn);
}

#if GUIDED
/// Writes `here` values of a block's field; whole blocks line by line where they are to go past the caches.
INLINE void store_field(const float* from, global float* restrict to, int here, bool streamed) {
    if (streamed && here == DRAW_BLOCK && (size_t)to % (LINE * sizeof(float)) == 0) {
        for (int k = 0; k < DRAW_BLOCK; k += LINE) STREAM_LINE(vload16(0, from + k), to + k);
        return;
    }
    for (int k = 0; k < here; ++k) to[k] = from[k];
}

/// The points of a block, from number `first` of the stream on.
INLINE void draw_points(DrawSettings by, uint first, uint* u_row, uint* u_column) {
    for (uint k = 0u; k < DRAW_BLOCK / 2u; ++k) {
        const PointPair points = sequence_points(by.seed_low, by.seed_high, DOMAIN_SHARED, 0u, first / 2u + k, by.strata);
        u_row[2u * k] = points.even.x;
        u_row[2u * k + 1u] = points.odd.x;
        u_column[2u * k] = points.even.y;
        u_column[2u * k + 1u] = points.odd.y;
    }
}

/// The rows of a block's points, and where each ends in the marginal. Few need more than one halving of their guide's
/// rows; those get them one by one.
INLINE void find_rows(global const uint* restrict marginal, global const uint* restrict guide, DrawSettings by,
                      const uint* u_row, int* row, uint* row_end) {
    Marks unresolved;
    const int last_row = (int)by.height - 1;
    EACH_SAMPLE {
        const uint value = u_row[k] >> (32 - TABLE_BITS);
        const int start = (int)guide[value >> (TABLE_BITS - by.row_bits)];
        row[k] = quick_halving(marginal, 0, start, last_row, value, 0);
        row_end[k] = marginal[row[k]];
        unresolved.each[k] = row_end[k] <= value;
    }
    UNRESOLVED_SAMPLES {
        if (!unresolved.each[k]) continue;
        const uint value = u_row[k] >> (32 - TABLE_BITS);
        const uint end_row = guide[(value >> (TABLE_BITS - by.row_bits)) + 1u];
        row[k] = (int)bisect_alone(marginal, (uint)row[k] + 1u, end_row, value);
        row_end[k] = marginal[row[k]];
    }
}

/// The same of columns within the rows; QUICK_STEPS halvings are enough for most.
INLINE void find_columns(global const uint* restrict conditional, global const uint* restrict guide, DrawSettings by,
                         const uint* u_column, const int* row, int* column, uint* end) {
    Marks unresolved;
    const int entries = (int)(1u << by.column_bits) + 1;
    EACH_SAMPLE {
        const uint entry = u_column[k] >> (32 - TABLE_BITS) >> (TABLE_BITS - by.column_bits);
        column[k] = (int)guide[row[k] * entries + (int)entry];
    }
    // The first halving, which finds its line of the table in no cache, has a loop of its own: the shorter the loop, the
    // more of its loads are under way together.
    const int width = (int)by.width;
    EACH_SAMPLE {
        const uint value = u_column[k] >> (32 - TABLE_BITS);
        column[k] = quick_halving(conditional, row[k] * width, column[k], width - 1, value, QUICK_STEPS - 1);
    }
    EACH_SAMPLE {
        const uint value = u_column[k] >> (32 - TABLE_BITS);
        const int base = row[k] * width;
        int j = column[k];
#pragma unroll
        for (int step = QUICK_STEPS - 2; step >= 0; --step) {
            j = quick_halving(conditional, base, j, width - 1, value, step);
        }
        column[k] = j;
        end[k] = conditional[base + j];
        unresolved.each[k] = end[k] <= value;
    }
    UNRESOLVED_SAMPLES {
        if (!unresolved.each[k]) continue;
        const uint value = u_column[k] >> (32 - TABLE_BITS);
        global const uint* ends = conditional + row[k] * width;
        const uint end_column = guide[row[k] * entries + (int)(value >> (TABLE_BITS - by.column_bits)) + 1];
        column[k] = (int)bisect_alone(ends, (uint)column[k] + 1u, end_column, value);
        end[k] = ends[column[k]];
    }
}

/// As draw_samples, for a device whose vectors run along inner loops: a work-item draws DRAW_BLOCK samples in one short
/// loop after another, so that each is vectorised and many loads are under way at a time.
/// Range: one work-item per DRAW_BLOCK samples.
kernel void draw_blocks(global const uint* restrict marginal, global const uint* restrict marginal_guide,
                        global const uint* restrict conditional, global const uint* restrict conditional_guide,
                        global const RowFrame* restrict frames, global const float* restrict radiance, DrawSettings by,
                        uint first, uint count, global uint* restrict texel, global float* restrict direction,
                        global float* restrict pdf, global float* restrict drawn) {
    const uint begin = DRAW_BLOCK * (uint)get_global_id(0);
    if (begin >= count) return;
    uint u_row[DRAW_BLOCK], u_column[DRAW_BLOCK];
    int row[DRAW_BLOCK], column[DRAW_BLOCK];
    uint row_end[DRAW_BLOCK], end[DRAW_BLOCK];
    float record[RECORD_FIELDS][DRAW_BLOCK];
    draw_points(by, first + begin, u_row, u_column);
    find_rows(marginal, marginal_guide, by, u_row, row, row_end);
    find_columns(conditional, conditional_guide, by, u_column, row, column, end);
    global const float* restrict frame_fields = (global const float*)frames;
    const int last_row = (int)by.height - 1;
    EACH_SAMPLE {
        const int i = row[k];
        const int j = column[k];
        const int at = i * (int)by.width + j;
        Draw draw;
        draw.row = (uint)i;
        draw.column = (uint)j;
        place_within(&draw, u_row[k], u_column[k], start_of(marginal, i, i), row_end[k], start_of(conditional, j, at),
                     end[k]);
        RowFrame frame;
        frame.cap = frame_fields[4 * i];
        frame.cap_step = frame_fields[4 * i + 1];
        frame.pole = i <= last_row - i ? 1.0f : -1.0f;
        frame.solid_angle = frame_fields[4 * i + 3];
        const Direction towards = draw_direction(draw, frame, by.inverse_width, by.rotation);
        record[0][k] = as_float(at);
        record[1][k] = towards.x;
        record[2][k] = towards.y;
        record[3][k] = towards.z;
        record[4][k] = draw_pdf(draw, frame);
    }
    EACH_SAMPLE {
        const int at = 3 * as_int(record[0][k]);
        record[5][k] = radiance[at];
        record[6][k] = radiance[at + 1];
        record[7][k] = radiance[at + 2];
    }
    const size_t plane = count;
    global float* fields[RECORD_FIELDS] = {(global float*)texel,  direction, direction + plane, direction + 2 * plane, pdf,
                                           drawn, drawn + plane, drawn + 2 * plane};
    const int here = (int)least(DRAW_BLOCK, count - begin);
#pragma unroll
    for (int field = 0; field < RECORD_FIELDS; ++field) {
        store_field(record[field], fields[field] + begin, here, count >= STREAMED_COUNT);
    }
}
#endif

/// The texel and the place within it of given points, for tests of every boundary.
///   u      [2 * count]  pairs of 32-bit fractions
///   texel  [count]
///   within [2 * count]  pairs: of the way down the row, along the column
/// Range: one work-item per point.
kernel void locate_points(global const uint* marginal, global const uint* marginal_guide,
                          global const uint* conditional, global const uint* conditional_guide, DrawSettings by,
                          global const uint* u, uint count, global uint* texel, global float* within) {
    const uint at = (uint)get_global_id(0);
    if (at >= count) return;
    const Tables tables = tables_of(marginal, marginal_guide, conditional, conditional_guide, by);
    const Point point = {u[2 * at], u[2 * at + 1]};
    const Draw draw = draw_texel(tables, point);
    texel[at] = draw.row * by.width + draw.column;
    within[2 * at] = draw.down;
    within[2 * at + 1] = draw.along;
}
