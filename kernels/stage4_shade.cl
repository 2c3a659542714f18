#pragma OPENCL FP_CONTRACT OFF
#include "pixels.clh"

/// Registers of PIXELS_WIDE pixels that are summed side by side: enough independent sums to hide an fma's latency.
#ifndef REGISTERS
#define REGISTERS 4
#endif
/// Lights added in float32 before their sum joins the pixel's: bounds the rounding of long sums.
#ifndef LIGHTS_PER_BLOCK
#define LIGHTS_PER_BLOCK 256u
#endif

/// Lights of a sample set: direction and 1/(pi N) of radiance over density, in planes of `stride`, zeros from `count`
/// on.
///   light [6 * stride]  x, y, z, weights of R, G, B
///   scale               2^-exponent of the map, which keeps the quotient within float32
///   inverse_count       1 / (pi N)
/// Range: one work-item per light, padding included.
kernel void weigh_lights(global const float* direction, global const float* pdf, global const float* drawn, uint count,
                         float scale, float inverse_count, uint stride, global float* light) {
    const size_t at = get_global_id(0);
    if (at >= stride) return;
    const bool real = at < count;
    const float factor = real ? inverse_count / pdf[at] : 0.0f;
    for (size_t c = 0; c < 3; ++c) {
        light[c * stride + at] = real ? direction[c * count + at] : 0.0f;
        light[(3 + c) * stride + at] = real ? drawn[c * count + at] * scale * factor : 0.0f;
    }
}

/// Adds one light to the sums of REGISTERS registers of pixels.
#define ADD_LIGHT(light, stride, j)                                                                  \
    {                                                                                                \
        const float x = (light)[j], y = (light)[(stride) + (j)], z = (light)[2 * (stride) + (j)];    \
        const float wr = (light)[3 * (stride) + (j)];                                                \
        const float wg = (light)[4 * (stride) + (j)];                                                \
        const float wb = (light)[5 * (stride) + (j)];                                                \
        _Pragma("unroll") for (int k = 0; k < REGISTERS; ++k) {                                      \
            const pixels_t cosine = fmax(fma(nx[k], x, fma(ny[k], y, nz[k] * z)), (pixels_t)(0.0f)); \
            r[k] = fma(cosine, (pixels_t)(wr), r[k]);                                                \
            g[k] = fma(cosine, (pixels_t)(wg), g[k]);                                                \
            b[k] = fma(cosine, (pixels_t)(wb), b[k]);                                                \
        }                                                                                            \
    }

/// Every pixel lit by one set of lights: radiance of a white diffuse surface. Every light meets every pixel.
///   normal [3 * stride]        three planes, unit length
///   light  [6 * light_stride]  see weigh_lights
///   add    0: the result replaces what stands there; 1: it is added, for light sets that come in batches
///   unit_albedo_radiance  [3 * stride]        three planes: R, G, B, times 2^-exponent of the map
/// Range: one work-item per PIXELS_WIDE * REGISTERS pixels; stride is a multiple of that. No local memory, no barrier.
/// Cost: 12 flop per pixel and light. Lights are added in their order, so the result is the same for any range.
/// Error: 1e-6 relative RMSE (measured in tests/stage4_shade_test.cpp).
/// Source: Pharr, Jakob, Humphreys, PBRT 4th ed., 2.1.
kernel void shade_shared(global const float* normal, global const float* light, uint count, uint light_stride,
                         uint stride, uint items, uint add, global float* unit_albedo_radiance) {
    const size_t item = get_global_id(0);
    if (item >= items) return;
    const size_t lights = light_stride;
    pixels_t nx[REGISTERS], ny[REGISTERS], nz[REGISTERS];
    pixels_t red[REGISTERS], green[REGISTERS], blue[REGISTERS];
#pragma unroll
    for (int k = 0; k < REGISTERS; ++k) {
        const size_t at = REGISTER_OF(item, items, k, REGISTERS);
        nx[k] = LOAD_PIXELS(at, normal);
        ny[k] = LOAD_PIXELS(at, normal + stride);
        nz[k] = LOAD_PIXELS(at, normal + 2 * (size_t)stride);
        red[k] = add == 0u ? (pixels_t)(0.0f) : LOAD_PIXELS(at, unit_albedo_radiance);
        green[k] = add == 0u ? (pixels_t)(0.0f) : LOAD_PIXELS(at, unit_albedo_radiance + stride);
        blue[k] = add == 0u ? (pixels_t)(0.0f) : LOAD_PIXELS(at, unit_albedo_radiance + 2 * (size_t)stride);
    }
    for (uint first = 0u; first < count; first += LIGHTS_PER_BLOCK) {
        const uint last = min(first + LIGHTS_PER_BLOCK, count);
        pixels_t r[REGISTERS], g[REGISTERS], b[REGISTERS];
#pragma unroll
        for (int k = 0; k < REGISTERS; ++k) r[k] = g[k] = b[k] = (pixels_t)(0.0f);
        for (uint j = first; j < last; ++j) ADD_LIGHT(light, lights, j)
#pragma unroll
        for (int k = 0; k < REGISTERS; ++k) {
            red[k] += r[k];
            green[k] += g[k];
            blue[k] += b[k];
        }
    }
#pragma unroll
    for (int k = 0; k < REGISTERS; ++k) {
        const size_t at = REGISTER_OF(item, items, k, REGISTERS);
        STORE_PIXELS(red[k], at, unit_albedo_radiance);
        STORE_PIXELS(green[k], at, unit_albedo_radiance + stride);
        STORE_PIXELS(blue[k], at, unit_albedo_radiance + 2 * (size_t)stride);
    }
}

#if PIXELS_WIDE == 16
/// Registers of a group: GROUP_PIXELS pixels that lie together on the sphere.
#define GROUP_REGISTERS (GROUP_PIXELS / PIXELS_WIDE)

/// Sums the lights of a block that are above the horizon of the whole cone, w l for each channel and component of l,
/// and notes each light's cosine with the axis.
///   axis    x, y, z
///   here    lights of the block
///   moment  9 sums, added to
INLINE void sum_whole_lights(global const float* block, size_t lights, uint here, const pixels_t* axis, float reach,
                             float* towards, pixels_t* moment) {
    pixels_t whole[9];
#pragma unroll
    for (int c = 0; c < 9; ++c) whole[c] = (pixels_t)(0.0f);
    for (uint v = 0u; v * PIXELS_WIDE < here; ++v) {
        const pixels_t x = LOAD_PIXELS(v, block);
        const pixels_t y = LOAD_PIXELS(v, block + lights);
        const pixels_t z = LOAD_PIXELS(v, block + 2 * lights);
        const pixels_t cosine = fma(axis[0], x, fma(axis[1], y, axis[2] * z));
        STORE_PIXELS(cosine, v, towards);
#pragma unroll
        for (int c = 0; c < 3; ++c) {
            const pixels_t w = cosine > reach ? LOAD_PIXELS(v, block + (3 + c) * lights) : (pixels_t)(0.0f);
            whole[3 * c] = fma(w, x, whole[3 * c]);
            whole[3 * c + 1] = fma(w, y, whole[3 * c + 1]);
            whole[3 * c + 2] = fma(w, z, whole[3 * c + 2]);
        }
    }
#pragma unroll
    for (int c = 0; c < 9; ++c) moment[c] += whole[c];
}

/// The lights of a block whose horizon crosses the cone, by their places in the block; returns how many.
INLINE uint find_crossing(const float* towards, uint here, float reach, uint* crossing) {
    uint crossings = 0u;
    for (uint j = 0u; j < here; ++j) {
        crossing[crossings] = j;
        crossings += fabs(towards[j]) <= reach ? 1u : 0u;
    }
    return crossings;
}

/// Adds those lights to the pixels of a group one by one.
///   sum [3 * GROUP_REGISTERS]  added to
INLINE void add_crossing(global const float* block, size_t lights, const uint* crossing, uint crossings,
                         global const float* normal, size_t first_register, uint stride, pixels_t* sum) {
    for (int pass = 0; pass < GROUP_REGISTERS; pass += REGISTERS) {
        pixels_t nx[REGISTERS], ny[REGISTERS], nz[REGISTERS];
        pixels_t r[REGISTERS], g[REGISTERS], b[REGISTERS];
#pragma unroll
        for (int k = 0; k < REGISTERS; ++k) {
            const size_t at = first_register + pass + k;
            nx[k] = LOAD_PIXELS(at, normal);
            ny[k] = LOAD_PIXELS(at, normal + stride);
            nz[k] = LOAD_PIXELS(at, normal + 2 * (size_t)stride);
            r[k] = g[k] = b[k] = (pixels_t)(0.0f);
        }
        for (uint i = 0u; i < crossings; ++i) ADD_LIGHT(block, lights, crossing[i])
#pragma unroll
        for (int k = 0; k < REGISTERS; ++k) {
            sum[3 * (pass + k)] += r[k];
            sum[3 * (pass + k) + 1] += g[k];
            sum[3 * (pass + k) + 2] += b[k];
        }
    }
}

/// What shade_shared computes, for groups of pixels whose normals lie within a cone. A light that is above the horizon
/// of the whole cone lights every pixel of the group by n . sum of w l, so such lights are summed once a group, as
/// three vectors; one below it lights none. Only those whose horizon crosses the cone meet the pixels one by one: for
/// groups of 256 pixels of a picture 511 wide, about a tenth.
///   cone [4 * groups]  axis x, y, z, unit length, and the sine of the half angle with a margin for rounding; above 1:
///                      every light may cross
/// The rest as in shade_shared. Range: one work-item per group.
/// Error: 1e-6 relative RMSE (measured in tests/stage4_shade_test.cpp); sums are in another order than shade_shared's.
kernel void shade_groups(global const float* normal, global const float* cone, global const float* light, uint count,
                         uint light_stride, uint stride, uint groups, uint add, global float* unit_albedo_radiance) {
    const size_t group = get_global_id(0);
    if (group >= groups) return;
    const size_t lights = light_stride;
    const size_t first_register = group * GROUP_REGISTERS;
    const pixels_t axis[3] = {(pixels_t)(cone[4 * group]), (pixels_t)(cone[4 * group + 1]),
                              (pixels_t)(cone[4 * group + 2])};
    const float reach = cone[4 * group + 3];
    pixels_t moment[9], sum[3 * GROUP_REGISTERS];
    for (int c = 0; c < 9; ++c) moment[c] = (pixels_t)(0.0f);
    for (int c = 0; c < 3 * GROUP_REGISTERS; ++c) sum[c] = (pixels_t)(0.0f);
    float towards[LIGHTS_PER_BLOCK];
    uint crossing[LIGHTS_PER_BLOCK];
    for (uint first = 0u; first < count; first += LIGHTS_PER_BLOCK) {
        const uint here = min(LIGHTS_PER_BLOCK, count - first);
        global const float* block = light + first;
        sum_whole_lights(block, lights, here, axis, reach, towards, moment);
        const uint crossings = find_crossing(towards, here, reach, crossing);
        if (crossings != 0u) add_crossing(block, lights, crossing, crossings, normal, first_register, stride, sum);
    }
    float m[9];
#pragma unroll
    for (int c = 0; c < 9; ++c) m[c] = sum_lanes(moment[c]);
    for (int k = 0; k < GROUP_REGISTERS; ++k) {
        const size_t at = first_register + k;
        const pixels_t nx = LOAD_PIXELS(at, normal);
        const pixels_t ny = LOAD_PIXELS(at, normal + stride);
        const pixels_t nz = LOAD_PIXELS(at, normal + 2 * (size_t)stride);
#pragma unroll
        for (int c = 0; c < 3; ++c) {
            global float* to = unit_albedo_radiance + c * (size_t)stride;
            const pixels_t whole = fma(nx, (pixels_t)(m[3 * c]), fma(ny, (pixels_t)(m[3 * c + 1]), nz * m[3 * c + 2]));
            const pixels_t before = add == 0u ? (pixels_t)(0.0f) : LOAD_PIXELS(at, to);
            STORE_PIXELS(before + (whole + sum[3 * k + c]), at, to);
        }
    }
}
#endif
