#pragma OPENCL FP_CONTRACT OFF
#include "marginal.clh"
#include "table.clh"
#include "wide_row.clh"

/// Texels whose ends are found together, before their guide entries are written.
#define PART_TEXELS 256u

/// Bits of the largest components between which a row's intensities may wait for its scale: nothing overflows, and
/// what is lost below 2^-126 weighs nothing (see LEAST_INTENSITY), so both orders of scaling agree to the bit.
#define LEAST_LARGEST 0x2B800000u  // 2^-40
#define MOST_LARGEST 0x71800000u   // 2^100

/// Value that entry `entry` of a guide stands for: see build_guides.
INLINE uint guide_value(uint entry, uint bits) {
    return entry == 1u << bits ? TABLE_ONE - 1u : entry << (TABLE_BITS - bits);
}

/// First guide entry whose value lies at or above `end`, for an end of any texel.
INLINE uint entry_above(uint end, uint bits) {
    const uint step = 1u << (TABLE_BITS - bits);
    return (end + (step - 1u)) >> (TABLE_BITS - bits);
}

/// Entries from `entry` on, which no texel ends above: the last one names the last lit texel.
INLINE void end_guide(global uint* guide, uint entry, uint bits, uint last) {
    for (; entry <= 1u << bits; ++entry) guide[entry] = last;
}

/// A row that holds a bad texel, or whose largest component is extreme, texel by texel.
INLINE void build_slowly(global const float* row, uint width, float3 luminance, uint bits,
                         global TexelCounts* row_counts,
                         global RowWeight* row_weight, global uint* table, global uint* guide) {
    TexelCounts counts = empty_counts(width);
    for (uint j = 0u; j < width; ++j) count_texel(&counts, row[3 * j], row[3 * j + 1], row[3 * j + 2], j);
    *row_counts = counts;
    RowWeight weight;
    weight.sum = 0ul;
    weight.lit = 0u;
    weight.exponent = scale_exponent(counts.max_component);
    const float scale = power_of_two(-weight.exponent);
    const uint end = has_bad_texels(counts) ? 0u : width;
    uint last = width - 1u;
    for (uint j = 0u; j < end; ++j) {
        const float r = row[3 * j];
        const float g = row[3 * j + 1];
        const float b = row[3 * j + 2];
        weight.sum += fixed_weight(scaled_intensity(r, g, b, scale, luminance));
        weight.lit += is_lit(r, g, b);
        last = is_lit(r, g, b) ? j : last;
    }
    *row_weight = weight;
    const float per_intensity = counts_per_intensity(weight.sum, weight.lit);
    uint running = 0u;
    for (uint j = 0u; j < end; ++j) {
        const float r = row[3 * j];
        const float g = row[3 * j + 1];
        const float b = row[3 * j + 2];
        running += texel_count(scaled_intensity(r, g, b, scale, luminance), per_intensity, is_lit(r, g, b));
        table[j] = running;
    }
    const uint stretch_by = stretch(running);
    uint entry = 0u;
    for (uint j = 0u; j < width; ++j) {
        table[j] = j < end ? table_end(table[j], running, stretch_by) : 0u;
        for (; entry < entry_above(table[j], bits); ++entry) guide[entry] = j;
    }
    end_guide(guide, entry, bits, last);
}

/// Sixteen texels as read_row takes them: `most` and `lit` gather over the row.
INLINE float16 read_texels(WideTexels t, float3 luminance, uint16* most, uint16* lit) {
    const uint16 bits = wide_largest(t);
    const uint16 is_lit = as_uint16(bits > 0u);
    *most = wide_most(*most, bits);
    *lit -= is_lit;  // a lane is all ones, or -1, where it is lit
    return wide_intensity(t, luminance, is_lit);
}

/// Reads a row once: its intensities, unscaled, and what of its weight is known by then.
///   largest  bits of its largest component
///   returns  the lit texels
INLINE uint read_row(global const float* row, uint width, float3 luminance, local float16* intensity, uint* largest) {
    const uint wide_end = width - width % WIDE;
    uint16 most = (uint16)(0u);
    uint16 lit = (uint16)(0u);
    for (uint j = 0u; j < wide_end; j += WIDE) {
        intensity[j / WIDE] = read_texels(load_wide(row, j), luminance, &most, &lit);
    }
    if (wide_end < width) {
        intensity[wide_end / WIDE] = read_texels(load_last(row, wide_end, width), luminance, &most, &lit);
    }
    *largest = largest_lane(most);
    return (uint)sum_of_lanes(lit);
}

/// Exact sum of a row's intensities. Sums of the halves of 2^20 / 16 numbers of 32 bits fit into 32 bits.
INLINE ulong sum_of_row(local const float16* intensity, uint width, float scale) {
    const float unit = scale * power_of_two(WEIGHT_BITS);
    uint16 low = (uint16)(0u);
    uint16 high = (uint16)(0u);
    for (uint j = 0u; j < width; j += WIDE) {
        const uint16 fixed = wide_fixed_weight(intensity[j / WIDE] * unit);
        low += fixed & 0xFFFFu;
        high += fixed >> 16;
    }
    return sum_of_lanes(low) + (sum_of_lanes(high) << 16);
}

INLINE uint total_of_row(local const float16* intensity, uint width, float per_intensity) {
    uint16 total = (uint16)(0u);
    for (uint j = 0u; j < width; j += WIDE) total += wide_count(intensity[j / WIDE], per_intensity);
    return (uint)sum_of_lanes(total);
}

/// Guide entries of texels from .. end - 1, from `entry` on, by their `above` (see entry_above); returns the last
/// one's. Each texel writes the entry that it may begin at, and the last to write it is right.
///   narrow  no texel spans a whole entry: none is left between
INLINE uint guide_part(global uint* guide, uint entry, const uint* above, uint from, uint end, bool narrow) {
    if (narrow) {
#pragma clang loop vectorize(disable) unroll_count(8)
        for (uint j = from; j < end; ++j) {
            guide[entry] = j;
            entry = above[j - from];
        }
        return entry;
    }
#pragma clang loop vectorize(disable)
    for (uint j = from; j < end; ++j) {
        const uint next = above[j - from];
        do guide[entry] = j;
        while (++entry < next);
        entry = next;
    }
    return entry;
}

/// Cumulative table of a row from its intensities, and its guide. Meanwhile the next row, as long, comes into the cache.
INLINE void scan_row(local const float16* intensity, uint width, float per_intensity, uint bits,
                     global const float* next_row, global uint* table, global uint* guide) {
    const uint total = total_of_row(intensity, width, per_intensity);
    const uint stretch_by = stretch(total);
    const uint step = 1u << (TABLE_BITS - bits);
    // A stretched count is off by one unit at each end, and two more at the row's.
    const uint narrow_count = sub_sat(step, mul_hi(step, stretch_by) + 4u);
    const bool aligned = width % WIDE == 0u;
    uint16 running = (uint16)(0u);
    uint entry = 0u;
    for (uint from = 0u; from < width; from += PART_TEXELS) {
        const uint end = least(width, from + PART_TEXELS);
        uint16 above[PART_TEXELS / WIDE];
        uint16 most = (uint16)(0u);
        for (uint j = from; j < end; j += WIDE) {
            const uint16 counts = wide_count(intensity[j / WIDE], per_intensity);
            most = wide_most(most, counts);
            const uint16 sums = wide_running(counts) + running;
            running = (uint16)(sums.sf);
            const uint16 ends = wide_table_end(sums, total, stretch_by);
            above[(j - from) / WIDE] = (ends + (step - 1u)) >> (TABLE_BITS - bits);
            if (aligned) {
                STREAM(ends, table + j);
            } else if (width - j >= WIDE) {
                vstore16(ends, 0, table + j);
            } else {
                store_last(ends, table + j, width - j);
            }
            PREFETCH(next_row + 3 * (size_t)j);
            PREFETCH(next_row + 3 * (size_t)j + WIDE);
            PREFETCH(next_row + 3 * (size_t)j + 2 * WIDE);
        }
        entry = guide_part(guide, entry, (const uint*)above, from, end, largest_lane(most) <= narrow_count);
    }
    uint last = width - 1u;
    if (total != 0u) {
        while (((local const float*)intensity)[last] == 0.0f) --last;
    }
    end_guide(guide, entry, bits, last);
}

/// Whole rows in one go: counts, weight and cumulative table. A row is read once; its intensities stay in the cache.
///   radiance    [3 * height * width]  linear RGB, row-major, top row first
///   first_row                         rows first_row .. first_row + rows - 1 are built
///   row_counts  [height], row_weight [height]
///   conditional [height * width]      end of each texel, in units of 2^-TABLE_BITS; the last lit one ends at TABLE_ONE
///   guide       [height * (2^bits + 1)]  see build_guides
///   intensity   [ceil(width / 16)]    work space
/// A row with a bad texel (see TexelCounts), or a black one, becomes all zero; its guide points at its last texel.
/// Range: one work-item per row, alone in its group. No barrier.
/// Exact: equal to the bit to the chunked path, and to reference::row_table.
kernel void build_rows(global const float* radiance, uint width, uint first_row, uint rows, float luminance_r,
                       float luminance_g, float luminance_b, uint bits, global TexelCounts* row_counts,
                       global RowWeight* row_weight, global uint* conditional, global uint* guide,
                       local float16* intensity) {
    const uint item = (uint)get_global_id(0);
    if (item >= rows) return;
    const size_t row_index = first_row + item;
    const global float* row = radiance + 3 * (size_t)width * row_index;
    const global float* next_row = item + 1u < rows ? row + 3 * (size_t)width : row;
    global uint* table = conditional + (size_t)width * row_index;
    global uint* row_guide = guide + (size_t)((1u << bits) + 1u) * row_index;
    const float3 luminance = (float3)(luminance_r, luminance_g, luminance_b);

    uint largest;
    RowWeight weight;
    weight.lit = read_row(row, width, luminance, intensity, &largest);
    if (largest > MOST_LARGEST || (largest < LEAST_LARGEST && largest != 0u)) {
        build_slowly(row, width, luminance, bits, row_counts + row_index, row_weight + row_index, table, row_guide);
        return;
    }
    TexelCounts counts = empty_counts(width);
    counts.zero_count = width - weight.lit;
    counts.max_component = as_float(largest);
    row_counts[row_index] = counts;
    weight.exponent = scale_exponent(counts.max_component);
    const float scale = power_of_two(-weight.exponent);
    weight.sum = sum_of_row(intensity, width, scale);
    row_weight[row_index] = weight;
    const float per_intensity = scale * counts_per_intensity(weight.sum, weight.lit);
    scan_row(intensity, width, per_intensity, bits, next_row, table, row_guide);
}

/// Running counts of every chunk, from 0 at its start, and their total.
///   total       [height * chunks]
///   conditional [height * width]   running counts, to be finished by finish_chunks
/// Range: one work-item per chunk.
kernel void scan_chunks(global const float* radiance, global const TexelCounts* row_counts,
                        global const RowWeight* row_weight, uint width, uint chunks, uint items, float luminance_r,
                        float luminance_g, float luminance_b, global uint* total, global uint* conditional) {
    const uint item = (uint)get_global_id(0);
    if (item >= items) return;
    const uint first = item % chunks * CHUNK_TEXELS;
    const uint last = min(first + CHUNK_TEXELS, width);
    const size_t row_index = item / chunks;
    const global float* row = radiance + 3 * (size_t)width * row_index;
    global uint* table = conditional + (size_t)width * row_index;
    const float3 luminance = (float3)(luminance_r, luminance_g, luminance_b);
    const RowWeight weight = row_weight[row_index];
    const bool dark = has_bad_texels(row_counts[row_index]);
    const float scale = power_of_two(-weight.exponent);
    const float per_intensity = counts_per_intensity(weight.sum, weight.lit);
    uint running = 0u;
    for (uint j = first; j < last; ++j) {
        const float r = row[3 * j];
        const float g = row[3 * j + 1];
        const float b = row[3 * j + 2];
        const float intensity = scaled_intensity(r, g, b, scale, luminance);
        running += dark ? 0u : texel_count(intensity, per_intensity, is_lit(r, g, b));
        table[j] = running;
    }
    total[item] = running;
}

/// Start of every chunk, and the row's total.
///   start     [height * chunks]  running count before the chunk
///   row_total [height]
/// Range: one work-item per row.
kernel void scan_totals(global const uint* total, uint chunks, uint height, global uint* start,
                        global uint* row_total) {
    const uint row = (uint)get_global_id(0);
    if (row >= height) return;
    uint running = 0u;
    for (uint c = 0; c < chunks; ++c) {
        const size_t at = (size_t)row * chunks + c;
        start[at] = running;
        running += total[at];
    }
    row_total[row] = running;
}

/// Adds each chunk's start and stretches, which finishes the rows' tables.
/// Range: one work-item per chunk.
kernel void finish_chunks(global const uint* start, global const uint* row_total, uint width, uint chunks, uint items,
                          global uint* conditional) {
    const uint item = (uint)get_global_id(0);
    if (item >= items) return;
    const uint first = item % chunks * CHUNK_TEXELS;
    const uint last = min(first + CHUNK_TEXELS, width);
    const size_t row_index = item / chunks;
    global uint* table = conditional + (size_t)width * row_index;
    const uint offset = start[item];
    const uint row_end = row_total[row_index];
    const uint stretch_by = stretch(row_end);
    for (uint j = first; j < last; ++j) table[j] = table_end(offset + table[j], row_end, stretch_by);
}

/// The marginal table over rows.
///   sine     [height]  sin(theta) at each row's centre
///   share    [height]  work space
///   marginal [height]  end of each row, in units of 2^-TABLE_BITS; the last lit one ends at TABLE_ONE; all 0 if black
/// Range: one work-item: a map has too few rows for more to pay.
/// Exact integers: the largest row's share keeps 62 - floor(log2(height)) bits, and the others that many of its, at least 1 where lit.
kernel void scan_marginal(global const RowWeight* row_weight, global const float* sine, uint height,
                          global ulong* share, global uint* marginal) {
    if (get_global_id(0) != 0) return;
    int largest = INT_MIN;
    uint lit = 0u;
    for (uint i = 0; i < height; ++i) {
        if (row_weight[i].lit == 0u) continue;
        largest = max(largest, row_share(row_weight[i], sine[i]).exponent);
        ++lit;
    }
    ulong total = 0ul;
    for (uint i = 0; i < height; ++i) {
        share[i] = 0ul;
        if (row_weight[i].lit != 0u) {
            const RowShare part = row_share(row_weight[i], sine[i]);
            share[i] = cut_share(part.product, part.exponent, largest, height);
        }
        total += share[i];
    }
    ulong running = 0ul;
    uint lit_so_far = 0u;
    for (uint i = 0; i < height; ++i) {
        running += share[i];
        lit_so_far += share[i] != 0ul;
        marginal[i] = marginal_end(running, lit_so_far, total, lit);
    }
}

/// First index of `table` whose end lies above `value`; `count` where there is none.
uint first_above(global const uint* table, uint count, uint value) {
    uint low = 0u;
    uint high = count;
    while (low < high) {
        const uint middle = low + (high - low) / 2u;
        if (table[middle] > value) {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    return low;
}

/// Guide tables: where a search may start. Entry b of a table's guide is the first element whose end lies above
/// b * 2^(TABLE_BITS - bits); the last one is the last element that can be drawn.
///   table [tables * count]               cumulative tables
///   guide [tables * (2^bits + 1)]
/// Range: one work-item per entry.
/// Source: Chen and Asau, On generating random variates from an empirical distribution, AIIE Trans. 6 (1974).
kernel void build_guides(global const uint* table, uint count, uint tables, uint bits, global uint* guide) {
    const size_t item = get_global_id(0);
    const uint entries = (1u << bits) + 1u;
    if (item >= (size_t)tables * entries) return;
    const size_t which = item / entries;
    const uint entry = (uint)(item % entries);
    guide[item] = min(first_above(table + which * count, count, guide_value(entry, bits)), count - 1u);
}
