#pragma OPENCL FP_CONTRACT OFF
#include "inline.clh"

/// The marks' colour, opaque green, as bytes R, G, B, A from the lowest.
#define MARK_COLOUR 0xFF00FF00u
/// Half a mark's side, rounded down: marks are 5x5.
#define MARK_REACH 2

/// Places the sphere's pixels in the image.
///   unit_albedo_radiance [3 * stride]   three planes: radiance of a white surface
///   pixel [count]        place in the image: row * size + column
///   gain                 albedo times the environment's scale times 2^exponent of the map, as two factors, so that
///                        neither leaves float32 where their product does not
///   rgba  [4 * pixels]   cleared before
/// Range: one work-item per pixel of the sphere.
kernel void compose(global const float* unit_albedo_radiance, global const uint* pixel, uint count, uint stride,
                    float gain_a,
                    float gain_b, global float* rgba) {
    const uint at = (uint)get_global_id(0);
    if (at >= count) return;
    global float* to = rgba + 4 * (size_t)pixel[at];
    to[0] = unit_albedo_radiance[at] * gain_a * gain_b;
    to[1] = unit_albedo_radiance[(size_t)stride + at] * gain_a * gain_b;
    to[2] = unit_albedo_radiance[2 * (size_t)stride + at] * gain_a * gain_b;
    to[3] = 1.0f;
}

/// 8-bit value of an exposed radiance: how many of the curve's 255 steps lie at or below it. NaN gives 0.
///   step  [255]  ascending: where round(255 x^(1/gamma)) becomes 1, 2, ... 255
INLINE uint tone(float exposed, global const float* step) {
    uint above = step[127] <= exposed ? 128u : 0u;
    above += step[above + 63u] <= exposed ? 64u : 0u;
    above += step[above + 31u] <= exposed ? 32u : 0u;
    above += step[above + 15u] <= exposed ? 16u : 0u;
    above += step[above + 7u] <= exposed ? 8u : 0u;
    above += step[above + 3u] <= exposed ? 4u : 0u;
    above += step[above + 1u] <= exposed ? 2u : 0u;
    above += step[above] <= exposed ? 1u : 0u;
    return above;
}

/// 8-bit value of a share, held to 0 .. 1. NaN gives 0.
INLINE uint byte_of_share(float share) {
    const float held = not_negative(share);
    return convert_uint(255.0f * (held < 1.0f ? held : 1.0f) + 0.5f);
}

/// Preview of an image: four bytes a pixel, R lowest.
///   from     [channels * count]  interleaved, 3 or 4 channels; the fourth is alpha
///   step     [255]               see tone
///   preview  [count]
/// Range: one work-item per pixel. Exact but for the product with the exposure, half an ulp.
kernel void tone_map(global const float* from, uint channels, uint count, float exposure, global const float* step,
                     global uint* preview) {
    const uint at = (uint)get_global_id(0);
    if (at >= count) return;
    global const float* pixel = from + (size_t)channels * at;
    const uint alpha = byte_of_share(channels == 4u ? pixel[3] : 1.0f);
    preview[at] = tone(exposure * pixel[0], step) | tone(exposure * pixel[1], step) << 8 |
                  tone(exposure * pixel[2], step) << 16 | alpha << 24;
}

/// Marks every sample's texel with a 5x5 square, cut off at the map's edges.
///   texel   [count]            row * width + column
///   preview [height * width]   four bytes a pixel
/// Range: one work-item per sample. Exchanges are atomic because marks overlap; all write the same value.
kernel void mark_samples(global const uint* texel, uint count, uint width, uint height, global uint* preview) {
    const uint at = (uint)get_global_id(0);
    if (at >= count) return;
    const int row = (int)(texel[at] / width);
    const int column = (int)(texel[at] % width);
    for (int i = max(row - MARK_REACH, 0); i <= min(row + MARK_REACH, (int)height - 1); ++i) {
        for (int j = max(column - MARK_REACH, 0); j <= min(column + MARK_REACH, (int)width - 1); ++j) {
            atomic_xchg((volatile global uint*)&preview[(size_t)i * width + j], MARK_COLOUR);
        }
    }
}
