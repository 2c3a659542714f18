#pragma OPENCL FP_CONTRACT OFF
#include "draw.clh"
#include "sequence.clh"
#include "shading.clh"

/// Registers of PIXELS_WIDE pixels that one work-item fills: enough independent sums to hide an fma's latency.
#ifndef REGISTERS
#define REGISTERS 4
#endif
/// Lights added in float32 before their sum joins the pixel's: bounds the rounding of long sums.
#ifndef LIGHTS_PER_BLOCK
#define LIGHTS_PER_BLOCK 256u
#endif

/// Lights of a sample set: direction and 1/(pi N) of radiance over density.
///   light [8 * count]  x, y, z, 0, weights of R, G, B, 0
///   scale              2^-exponent of the map, which keeps the quotient within float32
///   inverse_count      1 / (pi N)
/// Range: one work-item per sample.
kernel void weigh_lights(global const float* direction, global const float* pdf, global const float* drawn, uint count,
                         float scale, float inverse_count, global float* light) {
    const uint at = (uint)get_global_id(0);
    if (at >= count) return;
    const float factor = inverse_count / pdf[at];
    global float* to = light + 8 * (size_t)at;
    to[0] = direction[at];
    to[1] = direction[(size_t)count + at];
    to[2] = direction[2 * (size_t)count + at];
    to[3] = 0.0f;
    to[4] = drawn[at] * scale * factor;
    to[5] = drawn[(size_t)count + at] * scale * factor;
    to[6] = drawn[2 * (size_t)count + at] * scale * factor;
    to[7] = 0.0f;
}

/// Every pixel lit by one set of lights: radiance of a white diffuse surface.
///   normal [3 * stride]  three planes, unit length
///   light  [8 * count]   see weigh_lights
///   add    0: the result replaces what stands in white; 1: it is added, for light sets that come in batches
///   white  [3 * stride]  three planes: R, G, B, times 2^-exponent of the map
/// Range: one work-item per PIXELS_WIDE * REGISTERS pixels; stride is a multiple of that. No local memory, no barrier.
/// Cost: 12 flop per pixel and light. Lights are added in their order, so the result is the same for any range.
/// Error: 1e-6 relative RMSE (measured in tests/stage4_shade_test.cpp).
/// Source: Pharr, Jakob, Humphreys, PBRT 4th ed., 2.1.
kernel void shade_shared(global const float* normal, global const float* light, uint count, uint stride, uint items,
                         uint add, global float* white) {
    const size_t item = get_global_id(0);
    if (item >= items) return;
    pixels_t nx[REGISTERS], ny[REGISTERS], nz[REGISTERS];
    pixels_t red[REGISTERS], green[REGISTERS], blue[REGISTERS];
#pragma unroll
    for (int k = 0; k < REGISTERS; ++k) {
        const size_t at = item * REGISTERS + k;
        nx[k] = LOAD_PIXELS(at, normal);
        ny[k] = LOAD_PIXELS(at, normal + stride);
        nz[k] = LOAD_PIXELS(at, normal + 2 * (size_t)stride);
        red[k] = add == 0u ? (pixels_t)(0.0f) : LOAD_PIXELS(at, white);
        green[k] = add == 0u ? (pixels_t)(0.0f) : LOAD_PIXELS(at, white + stride);
        blue[k] = add == 0u ? (pixels_t)(0.0f) : LOAD_PIXELS(at, white + 2 * (size_t)stride);
    }
    for (uint first = 0u; first < count; first += LIGHTS_PER_BLOCK) {
        const uint last = min(first + LIGHTS_PER_BLOCK, count);
        pixels_t r[REGISTERS], g[REGISTERS], b[REGISTERS];
#pragma unroll
        for (int k = 0; k < REGISTERS; ++k) r[k] = g[k] = b[k] = (pixels_t)(0.0f);
        for (uint j = first; j < last; ++j) {
            global const float* l = light + 8 * (size_t)j;
            const float x = l[0], y = l[1], z = l[2];
            const float wr = l[4], wg = l[5], wb = l[6];
#pragma unroll
            for (int k = 0; k < REGISTERS; ++k) {
                const pixels_t counted = sample_lobes(nx[k], ny[k], nz[k], x, y, z);
                r[k] = fma(counted, (pixels_t)(wr), r[k]);
                g[k] = fma(counted, (pixels_t)(wg), g[k]);
                b[k] = fma(counted, (pixels_t)(wb), b[k]);
            }
        }
#pragma unroll
        for (int k = 0; k < REGISTERS; ++k) {
            red[k] += r[k];
            green[k] += g[k];
            blue[k] += b[k];
        }
    }
#pragma unroll
    for (int k = 0; k < REGISTERS; ++k) {
        const size_t at = item * REGISTERS + k;
        STORE_PIXELS(red[k], at, white);
        STORE_PIXELS(green[k], at, white + stride);
        STORE_PIXELS(blue[k], at, white + 2 * (size_t)stride);
    }
}

/// Adds samples 2k and 2k + 1 of each pixel's own set to the pixel; run for k = 0 .. ceil(N / 2) - 1, in order.
///   stream [stride]      number of each pixel's stream: its place in the image
///   both                 0 where the last sample of an odd N stands alone
///   white  [3 * stride]  three planes, added to; written first where k is 0, unless a control variate stands there
/// Range: one work-item per pixel: without an inner loop the device's vectors run across pixels.
/// Error: 3e-6 relative RMSE at worst, of one sample low over the horizon (measured in tests/stage4_shade_test.cpp).
kernel void shade_per_pixel(global const uint* marginal, global const uint* marginal_guide, uint height, uint row_bits,
                            global const uint* conditional, global const uint* conditional_guide, uint width,
                            uint column_bits, global const RowFrame* frames, global const float* radiance,
                            float inverse_width, float rotation, uint seed_low, uint seed_high, Strata strata,
                            float scale, float inverse_count, uint k, uint both, global const float* normal,
                            global const uint* stream, uint stride, global float* white) {
    const uint at = (uint)get_global_id(0);
    if (at >= stride) return;
    const Tables tables = {marginal, marginal_guide, conditional, conditional_guide, width, height, row_bits, column_bits};
    const PointPair points = sequence_points(seed_low, seed_high, DOMAIN_PER_PIXEL, stream[at], k, strata);
    const float nx = normal[at];
    const float ny = normal[(size_t)stride + at];
    const float nz = normal[2 * (size_t)stride + at];
    float r = 0.0f;
    float g = 0.0f;
    float b = 0.0f;
    // Radiance meets the map's scale first: the scale times the rest may leave float32 where all three together do not.
#pragma unroll
    for (int which = 0; which < 2; ++which) {
        const Draw draw = draw_texel(tables, which == 0 ? points.even : points.odd);
        const RowFrame frame = load_frame(frames, draw.row);
        const Direction towards = draw_direction(draw, frame, inverse_width, rotation);
        const float counted = lobe(FMA(nx, towards.x, FMA(ny, towards.y, nz * towards.z)));
        const float factor = which == 1 && both == 0u ? 0.0f : counted * (inverse_count / draw_pdf(draw, frame));
        const size_t index = 3 * ((size_t)draw.row * width + draw.column);
        r = FMA(radiance[index] * scale, factor, r);
        g = FMA(radiance[index + 1] * scale, factor, g);
        b = FMA(radiance[index + 2] * scale, factor, b);
    }
    const bool fresh = CONTROL_DEGREE == 0 && k == 0u;
    white[at] = fresh ? r : white[at] + r;
    white[(size_t)stride + at] = fresh ? g : white[(size_t)stride + at] + g;
    white[2 * (size_t)stride + at] = fresh ? b : white[2 * (size_t)stride + at] + b;
}
