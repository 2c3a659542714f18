#pragma OPENCL FP_CONTRACT OFF
// Stages 1 and 2 for devices whose work-items run in lock step: SCAN_LANES of them make a group that takes a chunk of a
// row, or a tile of a list, together. Neighbouring items read and write neighbouring words. Barriers stand in no loop
// and under no condition, which is what drivers have been seen to get wrong. Integers: equal to stage1_weight.cl and
// stage2_cdf.cl to the bit.
#include "marginal.clh"
#include "table.clh"

/// Work-items of a group, a power of two up to 256; set by the host.
#ifndef SCAN_LANES
#define SCAN_LANES 256u
#endif
/// Texels that each of them scans: neighbouring ones, once the chunk is in local memory.
#define LANE_TEXELS (CHUNK_TEXELS / SCAN_LANES)
/// Place of a chunk's element in local memory: one word of padding after each lane's, so that lanes meet other banks.
#define PADDED(j) ((j) + (j) / LANE_TEXELS)
#define SYNC barrier(CLK_LOCAL_MEM_FENCE)

/// Each of `steps` that the group is large enough for.
#define WHERE_WIDER_THAN(step) if (lane < (step) && (step) < SCAN_LANES)

#define JOIN_CENSUS(step)                                                                   \
    WHERE_WIDER_THAN(step) part[lane] = joined_counts(part[lane], part[lane + (step)]);     \
    SYNC
#define ADD_SUMS(step)                               \
    WHERE_WIDER_THAN(step) {                         \
        sums[lane] += sums[lane + (step)];           \
        lits[lane] += lits[lane + (step)];           \
    }                                                \
    SYNC
#define KEEP_LARGER(step)                                                     \
    WHERE_WIDER_THAN(step) largest[lane] = max(largest[lane], largest[lane + (step)]); \
    SYNC
/// One step of a running sum over the lanes, from one array into another.
/// Source: Hillis, Steele, Data Parallel Algorithms, CACM 29 (1986).
#define ADD_LOWER(from, to, step)                                                  \
    to[lane] = from[lane] + (lane >= (step) ? from[lane - min((step), lane)] : 0); \
    SYNC

/// All of a tree's steps, the widest first.
#define TREE(STEP) STEP(128u); STEP(64u); STEP(32u); STEP(16u); STEP(8u); STEP(4u); STEP(2u); STEP(1u)
/// Running sums over the lanes: from `a`, by way of `b`, in `a`.
#define SCAN(a, b)                                                                                    \
    ADD_LOWER(a, b, 1u); ADD_LOWER(b, a, 2u); ADD_LOWER(a, b, 4u); ADD_LOWER(b, a, 8u);               \
    ADD_LOWER(a, b, 16u); ADD_LOWER(b, a, 32u); ADD_LOWER(a, b, 64u); ADD_LOWER(b, a, 128u)

/// Where a group's chunk lies.
typedef struct {
    size_t row_index;
    uint first;
    uint last;
} Chunk;

INLINE Chunk chunk_of(uint width, uint chunks) {
    const uint group = (uint)get_group_id(0);
    Chunk chunk;
    chunk.row_index = group / chunks;
    chunk.first = group % chunks * CHUNK_TEXELS;
    chunk.last = min(chunk.first + CHUNK_TEXELS, width);
    return chunk;
}

/// Counts of every chunk; see count_chunks.
/// Range: a group per chunk.
kernel __attribute__((reqd_work_group_size(SCAN_LANES, 1, 1)))
void count_groups(global const float* radiance, uint width, uint chunks, global TexelCounts* counts) {
    local TexelCounts part[SCAN_LANES];
    const uint lane = (uint)get_local_id(0);
    const Chunk chunk = chunk_of(width, chunks);
    global const float* row = radiance + 3 * (size_t)width * chunk.row_index;
    TexelCounts found = empty_counts(width);
    for (uint j = chunk.first + lane; j < chunk.last; j += SCAN_LANES) {
        count_texel(&found, row[3 * j], row[3 * j + 1], row[3 * j + 2], j);
    }
    part[lane] = found;
    SYNC;
    TREE(JOIN_CENSUS);
    if (lane == 0u) counts[get_group_id(0)] = part[0];
}

/// Sum of the fixed-point intensities of every chunk; see sum_chunks.
/// Range: a group per chunk.
kernel __attribute__((reqd_work_group_size(SCAN_LANES, 1, 1)))
void sum_groups(global const float* radiance, global const TexelCounts* row_counts, uint width, uint chunks,
                float luminance_r, float luminance_g, float luminance_b, global RowWeight* weight) {
    local ulong sums[SCAN_LANES];
    local uint lits[SCAN_LANES];
    const uint lane = (uint)get_local_id(0);
    const Chunk chunk = chunk_of(width, chunks);
    global const float* row = radiance + 3 * (size_t)width * chunk.row_index;
    const float3 luminance = (float3)(luminance_r, luminance_g, luminance_b);
    const TexelCounts counts = row_counts[chunk.row_index];
    const int exponent = scale_exponent(counts.max_component);
    const float scale = power_of_two(-exponent);
    const uint last = has_bad_texels(counts) ? chunk.first : chunk.last;
    ulong sum = 0ul;
    uint lit = 0u;
    for (uint j = chunk.first + lane; j < last; j += SCAN_LANES) {
        const float r = row[3 * j];
        const float g = row[3 * j + 1];
        const float b = row[3 * j + 2];
        sum += fixed_weight(scaled_intensity(r, g, b, scale, luminance));
        lit += is_lit(r, g, b);
    }
    sums[lane] = sum;
    lits[lane] = lit;
    SYNC;
    TREE(ADD_SUMS);
    if (lane == 0u) {
        RowWeight joined;
        joined.sum = sums[0];
        joined.lit = lits[0];
        joined.exponent = exponent;
        weight[get_group_id(0)] = joined;
    }
}

/// Running counts of every chunk, from 0 at its start, and their total; see scan_chunks.
/// Range: a group per chunk. Each lane scans LANE_TEXELS neighbouring texels, and the lanes' totals are scanned.
kernel __attribute__((reqd_work_group_size(SCAN_LANES, 1, 1)))
void scan_groups(global const float* radiance, global const TexelCounts* row_counts, global const RowWeight* row_weight,
                 uint width, uint chunks, float luminance_r, float luminance_g, float luminance_b, global uint* total,
                 global uint* conditional) {
    local uint counts[PADDED(CHUNK_TEXELS)];
    local uint ends[SCAN_LANES];
    local uint others[SCAN_LANES];
    const uint lane = (uint)get_local_id(0);
    const Chunk chunk = chunk_of(width, chunks);
    global const float* row = radiance + 3 * (size_t)width * chunk.row_index;
    const float3 luminance = (float3)(luminance_r, luminance_g, luminance_b);
    const RowWeight weight = row_weight[chunk.row_index];
    const float scale = power_of_two(-weight.exponent);
    const float per_intensity = counts_per_intensity(weight.sum, weight.lit);
    const uint here = chunk.last - chunk.first;
    const uint good = has_bad_texels(row_counts[chunk.row_index]) ? 0u : here;
    for (uint j = lane; j < CHUNK_TEXELS; j += SCAN_LANES) {
        uint count = 0u;
        if (j < good) {
            const size_t at = 3 * (size_t)(chunk.first + j);
            const float r = row[at];
            const float g = row[at + 1];
            const float b = row[at + 2];
            count = texel_count(scaled_intensity(r, g, b, scale, luminance), per_intensity, is_lit(r, g, b));
        }
        counts[PADDED(j)] = count;
    }
    SYNC;
    uint own = 0u;
    for (uint k = 0u; k < LANE_TEXELS; ++k) own += counts[PADDED(lane * LANE_TEXELS + k)];
    ends[lane] = own;
    SYNC;
    SCAN(ends, others);
    uint running = ends[lane] - own;
    for (uint k = 0u; k < LANE_TEXELS; ++k) {
        const uint at = PADDED(lane * LANE_TEXELS + k);
        running += counts[at];
        counts[at] = running;
    }
    SYNC;
    global uint* table = conditional + (size_t)width * chunk.row_index + chunk.first;
    for (uint j = lane; j < here; j += SCAN_LANES) table[j] = counts[PADDED(j)];
    if (lane == SCAN_LANES - 1u) total[get_group_id(0)] = running;
}

/// Adds each chunk's start and stretches, which finishes the rows' tables; see finish_chunks.
/// Range: one work-item per texel.
kernel void finish_texels(global const uint* start, global const uint* row_total, uint width, uint chunks, uint texels,
                          global uint* conditional) {
    const size_t at = get_global_id(0);
    if (at >= texels) return;
    const uint row = (uint)(at / width);
    const uint column = (uint)(at % width);
    const uint offset = start[row * chunks + column / CHUNK_TEXELS];
    const uint row_end = row_total[row];
    conditional[at] = table_end(offset + conditional[at], row_end, stretch(row_end));
}

/// Every row's share of the marginal, and whether it is lit; see scan_marginal.
///   share [height], exponent [height] (INT_MIN where black), lit [height]
/// Range: one work-item per row.
kernel void share_rows(global const RowWeight* row_weight, global const float* sine, uint height, global ulong* share,
                       global int* exponent, global ulong* lit) {
    const uint i = (uint)get_global_id(0);
    if (i >= height) return;
    const RowShare part = row_share(row_weight[i], sine[i]);
    const bool is_lit_row = row_weight[i].lit != 0u;
    share[i] = part.product;
    exponent[i] = is_lit_row ? part.exponent : INT_MIN;
    lit[i] = is_lit_row;
}

/// The largest of all exponents.
///   found [1]
/// Range: one group.
kernel __attribute__((reqd_work_group_size(SCAN_LANES, 1, 1)))
void find_largest(global const int* exponent, uint height, global int* found) {
    local int largest[SCAN_LANES];
    const uint lane = (uint)get_local_id(0);
    int own = INT_MIN;
    for (uint i = lane; i < height; i += SCAN_LANES) own = max(own, exponent[i]);
    largest[lane] = own;
    SYNC;
    TREE(KEEP_LARGER);
    if (lane == 0u) found[0] = largest[0];
}

/// Brings every row's share to the scale of the largest.
/// Range: one work-item per row.
kernel void cut_shares(global const int* exponent, global const int* largest, uint height, global ulong* share) {
    const uint i = (uint)get_global_id(0);
    if (i >= height) return;
    share[i] = exponent[i] == INT_MIN ? 0ul : cut_share(share[i], exponent[i], largest[0], height);
}

/// Running sums of a list's tiles of SCAN_LANES numbers, and their totals.
///   value [count]                       replaced by its running sum within its tile
///   total [ceil(count / SCAN_LANES)]
/// Range: a group per tile.
kernel __attribute__((reqd_work_group_size(SCAN_LANES, 1, 1)))
void scan_tiles(global ulong* value, uint count, global ulong* total) {
    local ulong ends[SCAN_LANES];
    local ulong others[SCAN_LANES];
    const uint lane = (uint)get_local_id(0);
    const size_t at = get_global_id(0);
    ends[lane] = at < count ? value[at] : 0ul;
    SYNC;
    SCAN(ends, others);
    if (at < count) value[at] = ends[lane];
    if (lane == SCAN_LANES - 1u) total[get_group_id(0)] = ends[lane];
}

/// Adds to every number what the tiles before its own come to.
///   total [ceil(count / SCAN_LANES)]  running sums of scan_tiles' totals
/// Range: one work-item per number.
kernel void add_tiles(global const ulong* total, uint count, global ulong* value) {
    const size_t at = get_global_id(0);
    if (at >= count || at < SCAN_LANES) return;
    value[at] += total[at / SCAN_LANES - 1];
}

/// The marginal table from the running sums of the shares and of the lit rows.
/// Range: one work-item per row.
kernel void finish_marginal(global const ulong* share, global const ulong* lit, uint height, global uint* marginal) {
    const uint i = (uint)get_global_id(0);
    if (i >= height) return;
    marginal[i] = marginal_end(share[i], (uint)lit[i], share[height - 1u], (uint)lit[height - 1u]);
}
