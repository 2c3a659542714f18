#pragma OPENCL FP_CONTRACT OFF
#include "fresnel.clh"

/// Fresnel reflectance against incidence angle: two polarisations, their mean, Schlick's approximation.
///   media         [2 * 5]      eta, eta^2 - 1, sqrt(1 + eta^2), pi/2 - critical angle, R0; each as hi, lo
///   angle         [2 * count]  incidence from the normal, radians, as hi, lo
///   complement    [2 * count]  pi/2 - incidence
///   from_brewster [2 * count]  Brewster's angle - incidence
///   from_critical [2 * count]  critical angle - incidence; read where eta < 1
///   parallel, perpendicular, mean, schlick [count]  reflectance, [0, 1]
/// Range: one work-item per angle. No local memory, no barrier.
/// Error: at most 1 ulp against the host's long double, in double and in pairs of floats (measured in tests/fresnel_test.cpp).
/// Source: Born and Wolf, Principles of Optics, 1.5.2.
__kernel void reflect_angles(__global const float* media, __global const float* angle, __global const float* complement,
                             __global const float* from_brewster, __global const float* from_critical,
                             __global float* parallel, __global float* perpendicular, __global float* mean,
                             __global float* schlick, uint count) {
    const uint i = (uint)get_global_id(0);
    if (i >= count) return;
    const fresnel_media between = {real_load(media, 0), real_load(media, 1), real_load(media, 2), real_load(media, 3),
                                   real_load(media, 4)};
    const fresnel_angle incidence = {real_load(angle, i), real_load(complement, i), real_load(from_brewster, i),
                                     real_load(from_critical, i)};
    const fresnel_reflectance r = fresnel_at(between, incidence);
    parallel[i] = real_float(r.parallel);
    perpendicular[i] = real_float(r.perpendicular);
    mean[i] = real_float(r.mean);
    schlick[i] = real_float(r.schlick);
}
