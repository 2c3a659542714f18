#pragma OPENCL FP_CONTRACT OFF
#include "weight.clh"

// The cumulative tables that other implementations build, for comparison with the integer one: running sums of floating
// point, divided by their last. Nothing draws from them but the measurements of `study` and `info`.

/// Set by the host: the type of sums and tables.
#ifndef REAL
#define REAL float
#endif
/// Set by the host: 1 carries the sum's rounding error along.
#ifndef COMPENSATED
#define COMPENSATED 0
#endif

/// What a table's fraction is multiplied with to count in units of a 32-bit random number.
#define RANDOM_RANGE ((REAL)0x1p32f)

/// A running sum; `lost` is what its rounding took too much.
/// Source: Kahan, Further remarks on reducing truncation errors, CACM 8 (1965).
typedef struct {
    REAL sum;
    REAL lost;
} Running;

Running plus(Running running, REAL value) {
#if COMPENSATED
    const REAL wanted = value - running.lost;
    const REAL sum = running.sum + wanted;
    running.lost = (sum - running.sum) - wanted;
    running.sum = sum;
#else
    running.sum += value;
#endif
    return running;
}

bool is_good(float v) { return v >= 0.0f && v <= FLT_MAX; }

/// Weight of a texel, intensity times sine, in plain REAL arithmetic; 0 where a component is bad.
REAL real_weight(global const float* texel, float3 luminance, float sine) {
    if (!(is_good(texel[0]) && is_good(texel[1]) && is_good(texel[2]))) return 0;
    const REAL intensity = (REAL)luminance.x * (REAL)texel[0] + (REAL)luminance.y * (REAL)texel[1] +
                           (REAL)luminance.z * (REAL)texel[2];
    return intensity * (REAL)sine;
}

bool is_lit_and_good(global const float* texel) {
    return is_good(texel[0]) && is_good(texel[1]) && is_good(texel[2]) && is_lit(texel[0], texel[1], texel[2]);
}

/// Whether any 32-bit random number u, taken as the fraction u / 2^32 in REAL, falls into [start, end).
/// Fractions of 2^-8 or more hold every float; below, multiples of 2^-32 are floats: so the multiples decide.
bool is_drawable(REAL start, REAL end) { return ceil(start * RANDOM_RANGE) < end * RANDOM_RANGE; }

/// Sum of every row's weights.
///   radiance [3 * height * width]  linear RGB, row-major, top row first
///   sine     [height]              sin(theta) at each row's centre
///   total    [height]
/// Range: one work-item per row.
kernel void sum_rows(global const float* radiance, global const float* sine, uint width, uint height,
                     float luminance_r, float luminance_g, float luminance_b, global REAL* total) {
    const uint row = (uint)get_global_id(0);
    if (row >= height) return;
    global const float* texel = radiance + 3 * (size_t)width * row;
    const float3 luminance = (float3)(luminance_r, luminance_g, luminance_b);
    Running running = {0, 0};
    for (uint j = 0; j < width; ++j) running = plus(running, real_weight(texel + 3 * j, luminance, sine[row]));
    total[row] = running.sum;
}

/// Table over rows, from their sums.
///   marginal [height]  end of each row, as a fraction of the sum of all
///   sum      [1]       the sum of all
/// Range: one work-item.
kernel void scan_sums(global const REAL* total, uint height, global REAL* marginal, global REAL* sum) {
    if (get_global_id(0) != 0) return;
    Running running = {0, 0};
    for (uint i = 0; i < height; ++i) {
        running = plus(running, total[i]);
        marginal[i] = running.sum;
    }
    for (uint i = 0; i < height; ++i) marginal[i] /= running.sum;
    sum[0] = running.sum;
}

/// Tables over the columns of every row.
///   conditional [height * width]  end of each texel, as a fraction of its row's sum; 0 in a black row
/// Range: one work-item per row.
kernel void scan_rows(global const float* radiance, global const float* sine, global const REAL* total, uint width,
                      uint height, float luminance_r, float luminance_g, float luminance_b, global REAL* conditional) {
    const uint row = (uint)get_global_id(0);
    if (row >= height) return;
    global const float* texel = radiance + 3 * (size_t)width * row;
    global REAL* table = conditional + (size_t)width * row;
    const float3 luminance = (float3)(luminance_r, luminance_g, luminance_b);
    const REAL divisor = total[row] > 0 ? total[row] : 1;
    Running running = {0, 0};
    for (uint j = 0; j < width; ++j) {
        running = plus(running, real_weight(texel + 3 * j, luminance, sine[row]));
        table[j] = running.sum / divisor;
    }
}

/// Lit texels of every row, and those that no 32-bit random number draws, were the row itself drawn.
///   lit [height], undrawable [height]
/// Range: one work-item per row.
kernel void count_undrawable(global const float* radiance, global const float* sine, global const REAL* total,
                             uint width, uint height, float luminance_r, float luminance_g, float luminance_b,
                             global uint* lit, global uint* undrawable) {
    const uint row = (uint)get_global_id(0);
    if (row >= height) return;
    global const float* texel = radiance + 3 * (size_t)width * row;
    const float3 luminance = (float3)(luminance_r, luminance_g, luminance_b);
    const REAL divisor = total[row];
    Running running = {0, 0};
    REAL start = 0;
    uint lit_texels = 0u;
    uint lost_texels = 0u;
    for (uint j = 0; j < width; ++j) {
        running = plus(running, real_weight(texel + 3 * j, luminance, sine[row]));
        const REAL end = running.sum / divisor;
        const bool is_one = is_lit_and_good(texel + 3 * j);
        lit_texels += is_one;
        lost_texels += is_one && !is_drawable(start, end);
        start = end;
    }
    lit[row] = lit_texels;
    undrawable[row] = lost_texels;
}
