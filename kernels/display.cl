#pragma OPENCL FP_CONTRACT OFF

/// The marks' colour, opaque green, as bytes R, G, B, A from the lowest.
#define MARK_COLOUR 0xFF00FF00u
/// Half a mark's side, rounded down: marks are 5x5.
#define MARK_REACH 2

/// Places the sphere's pixels in the image.
///   white [3 * stride]   three planes: radiance of a white surface
///   pixel [count]        place in the image: row * size + column
///   gain                 albedo times the environment's scale times 2^exponent of the map, as two factors, so that
///                        neither leaves float32 where their product does not
///   rgba  [4 * pixels]   cleared before
/// Range: one work-item per pixel of the sphere.
kernel void compose(global const float* white, global const uint* pixel, uint count, uint stride, float gain_a,
                    float gain_b, global float* rgba) {
    const uint at = (uint)get_global_id(0);
    if (at >= count) return;
    global float* to = rgba + 4 * (size_t)pixel[at];
    to[0] = white[at] * gain_a * gain_b;
    to[1] = white[(size_t)stride + at] * gain_a * gain_b;
    to[2] = white[2 * (size_t)stride + at] * gain_a * gain_b;
    to[3] = 1.0f;
}

/// 8-bit value of a radiance: round(255 clamp(exposure L, 0, 1)^(1/gamma)). NaN gives 0.
uint tone(float radiance, float exposure, float inverse_gamma) {
    const float exposed = exposure * radiance;
    const float clamped = exposed > 0.0f ? fmin(exposed, 1.0f) : 0.0f;
    return convert_uint_rte(255.0f * powr(clamped, inverse_gamma));
}

/// Preview of an image: four bytes a pixel, R lowest.
///   from     [channels * count]  interleaved, 3 or 4 channels; the fourth is alpha
///   preview  [count]
/// Range: one work-item per pixel. Error: at most one step of 255, where the curve is within 1e-5 of a half.
kernel void tone_map(global const float* from, uint channels, uint count, float exposure, float inverse_gamma,
                     global uint* preview) {
    const uint at = (uint)get_global_id(0);
    if (at >= count) return;
    global const float* pixel = from + (size_t)channels * at;
    const uint alpha = channels == 4u ? convert_uchar_sat_rte(255.0f * pixel[3]) : 255u;
    preview[at] = tone(pixel[0], exposure, inverse_gamma) | tone(pixel[1], exposure, inverse_gamma) << 8 |
                  tone(pixel[2], exposure, inverse_gamma) << 16 | alpha << 24;
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
