#pragma OPENCL FP_CONTRACT OFF
#include "table.clh"
#include "wide_row.clh"

/// Census of texels begin .. end - 1 of a row, one by one.
INLINE void census_texels(Census* census, global const float* row, uint begin, uint end) {
    for (uint j = begin; j < end; ++j) take_census(census, row[3 * j], row[3 * j + 1], row[3 * j + 2], j);
}

/// Census of a row: sixteen texels at a time, and all of it again one by one where some are bad.
INLINE Census census_row(global const float* row, uint width) {
    const uint wide_end = width - width % WIDE;
    Census census = empty_census(width);
    uint16 fine = ~(uint16)(0u);
    uint16 lit = (uint16)(0u);
    float16 largest = (float16)(0.0f);
    for (uint j = 0u; j < wide_end; j += WIDE) {
        const WideTexels t = load_wide(row, j);
        fine &= wide_fine(t.r) & wide_fine(t.g) & wide_fine(t.b);
        lit -= wide_lit(t);  // a lane is all ones, or -1, where it is lit
        const float16 rg = t.r > t.g ? t.r : t.g;
        const float16 rgb = rg > t.b ? rg : t.b;
        largest = rgb > largest ? rgb : largest;
    }
    if (sum_of_lanes(~fine) != 0ul) {
        census_texels(&census, row, 0u, width);
        return census;
    }
    census.zero_count = wide_end - (uint)sum_of_lanes(lit);
    census.max_component = largest_lane(largest);
    census_texels(&census, row, wide_end, width);
    return census;
}

/// Exact sum of a row's intensities. Sums of the halves of 2^20 / 16 numbers of 32 bits fit into 32 bits.
INLINE RowWeight weigh_row(global const float* row, uint width, int exponent, float3 luminance) {
    const uint wide_end = width - width % WIDE;
    const float scale = power_of_two(-exponent);
    uint16 low = (uint16)(0u);
    uint16 high = (uint16)(0u);
    uint16 lit = (uint16)(0u);
    for (uint j = 0u; j < wide_end; j += WIDE) {
        const WideTexels t = load_wide(row, j);
        const uint16 fixed = wide_fixed_weight(wide_intensity(t, scale, luminance));
        low += fixed & 0xFFFFu;
        high += fixed >> 16;
        lit -= wide_lit(t);
    }
    RowWeight weight;
    weight.exponent = exponent;
    weight.sum = sum_of_lanes(low) + (sum_of_lanes(high) << 16);
    weight.lit = (uint)sum_of_lanes(lit);
    for (uint j = wide_end; j < width; ++j) {
        const float r = row[3 * j];
        const float g = row[3 * j + 1];
        const float b = row[3 * j + 2];
        weight.sum += fixed_weight(scaled_intensity(r, g, b, scale, luminance));
        weight.lit += is_lit(r, g, b);
    }
    return weight;
}

/// Value that entry `entry` of a guide stands for: see build_guides.
INLINE uint guide_value(uint entry, uint bits) {
    return entry == 1u << bits ? TABLE_ONE - 1u : entry << (TABLE_BITS - bits);
}

/// Cumulative table of a row, and its guide: entries are found as the ends pass their values.
INLINE void scan_row(global const float* row, uint width, RowWeight weight, float3 luminance, uint bits,
                     global uint* table, global uint* guide) {
    const uint wide_end = width - width % WIDE;
    const float scale = power_of_two(-weight.exponent);
    const float per_intensity = counts_per_intensity(weight.sum, weight.lit);
    uint running = 0u;
    for (uint j = 0u; j < wide_end; j += WIDE) {
        const WideTexels t = load_wide(row, j);
        const uint16 counts = wide_count(wide_intensity(t, scale, luminance), per_intensity, wide_lit(t));
        const uint16 ends = wide_running(counts) + running;
        vstore16(ends, 0, table + j);
        running = ends.sf;
    }
    for (uint j = wide_end; j < width; ++j) {
        const float r = row[3 * j];
        const float g = row[3 * j + 1];
        const float b = row[3 * j + 2];
        running += texel_count(scaled_intensity(r, g, b, scale, luminance), per_intensity, is_lit(r, g, b));
        table[j] = running;
    }
    const uint stretch_by = stretch(running);
    const uint entries = (1u << bits) + 1u;
    uint entry = 0u;
    for (uint j = 0u; j < wide_end; j += WIDE) {
        const uint16 ends = wide_table_end(vload16(0, table + j), running, stretch_by);
        vstore16(ends, 0, table + j);
        const uint last = ends.sf;
        for (; entry < entries && guide_value(entry, bits) < last; ++entry) {
            guide[entry] = j + wide_at_or_below(ends, guide_value(entry, bits));
        }
    }
    for (uint j = wide_end; j < width; ++j) {
        const uint end = table_end(table[j], running, stretch_by);
        table[j] = end;
        for (; entry < entries && guide_value(entry, bits) < end; ++entry) guide[entry] = j;
    }
}

/// Whole rows in one go: census, weight and cumulative table, while the row lies in the cache.
///   radiance    [3 * height * width]  linear RGB, row-major, top row first
///   first_row                         rows first_row .. first_row + rows - 1 are built
///   row_census  [height], row_weight [height]
///   conditional [height * width]      end of each texel, in units of 2^-TABLE_BITS; the last lit one ends at TABLE_ONE
///   guide       [height * (2^bits + 1)]  see build_guides
/// A row with a bad texel (see Census), or a black one, becomes all zero; its guide points at its last texel.
/// Range: one work-item per row. No local memory, no barrier.
/// Exact: equal to the bit to the chunked path, and to reference::row_table.
kernel void build_rows(global const float* radiance, uint width, uint first_row, uint rows, float luminance_r,
                       float luminance_g, float luminance_b, uint bits, global Census* row_census,
                       global RowWeight* row_weight, global uint* conditional, global uint* guide) {
    const uint item = (uint)get_global_id(0);
    if (item >= rows) return;
    const size_t row_index = first_row + item;
    const global float* row = radiance + 3 * (size_t)width * row_index;
    const uint entries = (1u << bits) + 1u;
    global uint* table = conditional + (size_t)width * row_index;
    global uint* row_guide = guide + (size_t)entries * row_index;
    const float3 luminance = (float3)(luminance_r, luminance_g, luminance_b);

    const Census census = census_row(row, width);
    row_census[row_index] = census;
    const int exponent = scale_exponent(census.max_component);
    if (has_bad_texels(census) || census.max_component == 0.0f) {
        row_weight[row_index].sum = 0ul;
        row_weight[row_index].exponent = exponent;
        row_weight[row_index].lit = 0u;
        for (uint j = 0; j < width; ++j) table[j] = 0u;
        for (uint entry = 0; entry < entries; ++entry) row_guide[entry] = width - 1u;
        return;
    }
    const RowWeight weight = weigh_row(row, width, exponent, luminance);
    row_weight[row_index] = weight;
    scan_row(row, width, weight, luminance, bits, table, row_guide);
}

/// Running counts of every chunk, from 0 at its start, and their total.
///   total       [height * chunks]
///   conditional [height * width]   running counts, to be finished by finish_chunks
/// Range: one work-item per chunk.
kernel void scan_chunks(global const float* radiance, global const Census* row_census,
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
    const bool dark = has_bad_texels(row_census[row_index]);
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

/// A row's share as a 64-bit mantissa: value = product * 2^exponent.
typedef struct {
    ulong product;
    int exponent;
} RowShare;

/// Sum of a row times the sine at its centre. 40 bits of the sum times 24 of the sine; the sum's lower bits are cut.
RowShare row_share(RowWeight weight, float sine) {
    RowShare share;
    share.product = 0ul;
    share.exponent = 0;
    if (weight.lit == 0u) return share;
    const int sum_shift = (int)clz(weight.sum) - 24;
    const ulong sum_bits = sum_shift >= 0 ? weight.sum << sum_shift : weight.sum >> -sum_shift;
    const int sine_exponent = ilogb(sine);
    const ulong sine_bits = convert_ulong(ldexp(sine, 23 - sine_exponent));
    const ulong product = sum_bits * sine_bits;
    const int lead = (int)clz(product);
    share.product = product << lead;
    share.exponent = weight.exponent - sum_shift + sine_exponent - lead;
    return share;
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
    const int headroom = 1 + 32 - (int)clz(height);
    ulong total = 0ul;
    for (uint i = 0; i < height; ++i) {
        ulong cut = 0ul;
        if (row_weight[i].lit != 0u) {
            const RowShare part = row_share(row_weight[i], sine[i]);
            const int shift = headroom + largest - part.exponent;
            cut = max(1ul, shift < 64 ? part.product >> shift : 0ul);
        }
        share[i] = cut;
        total += cut;
    }
    if (total == 0ul) {
        for (uint i = 0; i < height; ++i) marginal[i] = 0u;
        return;
    }
    const int lead = (int)clz(total);
    const ulong room = (ulong)(TABLE_ONE - lit);
    const ulong per_unit = (room << 32) / (((total << lead) >> 32) + 1ul);
    ulong running = 0ul;
    uint lit_so_far = 0u;
    for (uint i = 0; i < height; ++i) {
        running += share[i];
        lit_so_far += share[i] != 0ul;
        marginal[i] = running == total ? TABLE_ONE : (uint)mul_hi(running << lead, per_unit) + lit_so_far;
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
