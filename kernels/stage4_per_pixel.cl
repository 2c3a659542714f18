#pragma OPENCL FP_CONTRACT OFF
#include "draw.clh"
#include "residual_cosine.clh"
#include "sequence.clh"

/// Adds samples 2k and 2k + 1 of each pixel's own set to the pixel; run for k = 0 .. ceil(N / 2) - 1, in order.
///   stream [stride]      number of each pixel's stream: its place in the image
///   both                 0 where the last sample of an odd N stands alone
///   unit_albedo_radiance [3 * stride]  three planes, added to; written first where k is 0, unless a control variate
///                                      stands there
/// Range: one work-item per pixel: without an inner loop the device's vectors run across pixels.
/// Error: 3e-6 relative RMSE at worst, of one sample low over the horizon (measured in tests/stage4_shade_test.cpp).
kernel void shade_per_pixel(global const uint* marginal, global const uint* marginal_guide,
                            global const uint* conditional, global const uint* conditional_guide,
                            global const RowFrame* frames, global const float* radiance, DrawSettings by, float scale,
                            float inverse_count, uint k, uint both, global const float* normal,
                            global const uint* stream, uint stride, global float* unit_albedo_radiance) {
    const uint at = (uint)get_global_id(0);
    if (at >= stride) return;
    const Tables tables = tables_of(marginal, marginal_guide, conditional, conditional_guide, by);
    const PointPair points = sequence_points(by.seed_low, by.seed_high, DOMAIN_PER_PIXEL, stream[at], k, by.strata);
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
        const Direction towards = draw_direction(draw, frame, by.inverse_width, by.rotation);
        const float counted = residual_cosine(FMA(nx, towards.x, FMA(ny, towards.y, nz * towards.z)));
        const float factor = which == 1 && both == 0u ? 0.0f : counted * (inverse_count / draw_pdf(draw, frame));
        const size_t index = 3 * ((size_t)draw.row * by.width + draw.column);
        r = FMA(radiance[index] * scale, factor, r);
        g = FMA(radiance[index + 1] * scale, factor, g);
        b = FMA(radiance[index + 2] * scale, factor, b);
    }
    const bool fresh = CONTROL_DEGREE == 0 && k == 0u;
    unit_albedo_radiance[at] = fresh ? r : unit_albedo_radiance[at] + r;
    unit_albedo_radiance[(size_t)stride + at] = fresh ? g : unit_albedo_radiance[(size_t)stride + at] + g;
    unit_albedo_radiance[2 * (size_t)stride + at] = fresh ? b : unit_albedo_radiance[2 * (size_t)stride + at] + b;
}
