#pragma OPENCL FP_CONTRACT OFF
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
// Exact irradiance of a map whose radiance is constant over each texel's area, without a single node of quadrature.
//
// The integral of n . w over a region of the sphere is a line integral along its boundary (Lambert 1760):
// 1/2 of the integral of n . (w x dw). Over a texel's part above the horizon the boundary is made of pieces of circles
// of latitude, pieces of meridians, and arcs of the horizon itself, where n . (w x dw) is d(psi), psi the angle around n.
// Neighbours share edges, so an edge counts with the difference of radiance across it, and the arcs of the horizon
// telescope into (difference of radiance) * psi at each crossing of the horizon with the grid. So:
//   E(n) = 1/2 sum over latitudes [ piece above the horizon: two look-ups in prefix sums along the latitude ]
//        - 1/2 sum over meridians [ piece above the horizon: one look-up in prefix sums along the meridian ]
// That is 2 H + W look-ups a pixel in place of H W texels. What remains is rounding.
#include "irradiance.clh"

/// Doubles of an entry of the tables below. Of a latitude: for R, G, B a value and a fourth entry, the difference of
/// radiance of R, G, B: (flat, dR), (cosine, dG), (sine, dB). Of a meridian: value, 0, difference, 0.
#define LATITUDE_ENTRY 12
#define MERIDIAN_ENTRY 8
#define MERIDIANS_WIDE 8

/// How a latitude lies to a normal, in the first number of its crossing: below, above, or the half width in columns.
#define WHOLLY_BELOW -1.0
#define WHOLLY_ABOVE -2.0
/// A latitude this close to touching the horizon is treated as crossing it, and its corners decide.
#define TOUCHING 1e-12

double3 texel(global const float* radiance, size_t index, double scale) {
    return convert_double3(vload3(index, radiance)) * scale;
}

/// Normals in the map's frame. The length of (n_x, n_z) follows from n_y, which all pixels of a picture's row share.
///   normal  [3 * stride]  planes, unit length, in the world
///   ring    [stride]      number of the pixel's n_y in ring_y [rings]
///   turn    (cos, sin) of the map's rotation
///   frame   [4 * stride]  n_x, n_z, azimuth in columns, 0 <= azimuth < width, and the column behind the pixel
/// Range: one work-item per pixel.
kernel void frame_pixels(global const float* normal, global const uint* ring, global const double* ring_y, uint stride,
                         double turn_cos, double turn_sin, global const double* meridians, uint width,
                         global double* frame) {
    const size_t at = get_global_id(0);
    if (at >= stride) return;
    const double wx = normal[at];
    const double wz = normal[2 * (size_t)stride + at];
    const double y = ring_y[ring[at]];
    const double rho = distance_from_axis(y);
    const double x = fma(wx, turn_cos, wz * turn_sin);
    const double z = fma(wz, turn_cos, -(wx * turn_sin));
    const double length = sqrt(fma(x, x, z * z));
    const double nx = length > 0.0 ? x / length * rho : rho;
    const double nz = length > 0.0 ? z / length * rho : 0.0;
    const double turns = atan2(nz, nx) * INVERSE_TWO_PI_D;
    const double azimuth = fmod((turns < 0.0 ? turns + 1.0 : turns) * width, (double)width);
    double behind = floor(azimuth + 0.5 * width);
    const double fraction = azimuth + 0.5 * width - behind;
    behind = behind >= width ? behind - width : behind;
    // The pixel's circle is cut between meridians behind (at psi -> +pi) and behind + 1 (at psi -> -pi).
    const double tolerance = corner_tolerance(width);
    if (fraction < tolerance || fraction > 1.0 - tolerance) {
        const int j = (int)behind;
        const int next = j + 1 == (int)width ? 0 : j + 1;
        if (fraction < 0.5 && across_meridian(nx, nz, vload2(j, meridians)) < 0.0) {
            behind = j == 0 ? width - 1.0 : behind - 1.0;
        } else if (fraction > 0.5 && across_meridian(nx, nz, vload2(next, meridians)) >= 0.0) {
            behind = next;
        }
    }
    vstore4((double4)(nx, nz, azimuth, behind), at, frame);
}

/// Where latitudes first .. first + band - 1 cross the horizon of every n_y.
///   latitudes  [2 * (H + 1)]        cos(theta), sin(theta)
///   crossing   [4 * rings * band]   half width in columns (or WHOLLY_...), what a crossing adds beside its azimuth,
///                                   coefficients of the flat and of the cosine and sine sums
/// Range: one work-item per n_y and latitude.
kernel void cross_latitudes(global const double* ring_y, uint rings, global const double* latitudes, uint first,
                            uint band, uint width, global double* crossing) {
    const size_t at = get_global_id(0);
    if (at >= (size_t)rings * band) return;
    const double y = ring_y[at / band];
    const double2 latitude = vload2(first + at % band, latitudes);
    const double rho = distance_from_axis(y);
    const double c = latitude.x;
    const double s = latitude.y;
    const double q = s == 0.0 ? 0.0 : sqrt(fmax(0.0, (rho - c) * (rho + c)));
    const double side = y > 0.0 ? 1.0 : -1.0;
    const double half_width = atan2(q, -y * c);
    const double psi = atan2(q, -side * c);
    const bool untouched = s == 0.0 || fabs(c) > rho + TOUCHING;
    const double reach = half_width * INVERSE_TWO_PI_D * width;
    vstore4((double4)(untouched ? (y * c > 0.0 ? WHOLLY_ABOVE : WHOLLY_BELOW) : reach, fma(c, q, side * psi), -y * s * s,
                      c * s),
            at, crossing);
}

/// Prefix sums along latitudes: of the difference of radiance d (below less above; 0 beyond the poles) times d(phi),
/// d(sin phi) and -d(cos phi), each such that value + d * (phi, sin phi, -cos phi) is the sum up to phi. The last entry
/// is the whole circle's sum, with d = 0.
///   moments [LATITUDE_ENTRY * band * (width + 1)]
/// Range: one work-item per latitude.
kernel void sum_latitudes(global const float* radiance, uint width, uint height, double scale,
                          global const double* meridians, uint first, uint band, global double* moments) {
    const size_t at = get_global_id(0);
    if (at >= band) return;
    const uint i = first + (uint)at;
    global const float* above = radiance + 3 * (size_t)width * (i == 0u ? 0u : i - 1u);
    global const float* below = radiance + 3 * (size_t)width * (i == height ? 0u : i);
    const double scale_above = i == 0u ? 0.0 : scale;
    const double scale_below = i == height ? 0.0 : scale;
    const double step = TWO_PI_D / width;
    global double* to = moments + LATITUDE_ENTRY * at * ((size_t)width + 1);
    double3 flat = 0.0;
    double3 cosine = 0.0;
    double3 sine = 0.0;
    double2 from = vload2(0, meridians);
    for (uint j = 0u; j < width; ++j) {
        const double2 until = vload2(j + 1u, meridians);
        const double3 d = texel(below, j, scale_below) - texel(above, j, scale_above);
        vstore4((double4)(flat - d * (step * j), d.x), 0, to);
        vstore4((double4)(cosine - d * from.y, d.y), 1, to);
        vstore4((double4)(sine + d * from.x, d.z), 2, to);
        flat += d * step;
        cosine += d * (until.y - from.y);
        sine += d * (from.x - until.x);
        from = until;
        to += LATITUDE_ENTRY;
    }
    vstore4((double4)(flat, 0.0), 0, to);
    vstore4((double4)(cosine, 0.0), 1, to);
    vstore4((double4)(sine, 0.0), 2, to);
}

/// The same table by work-items in lock step: each sums one number of the entry along its latitude, so that neighbours
/// write neighbouring words. Equal to sum_latitudes to the bit.
/// Range: one work-item per latitude and number of its entry, numbers side by side.
kernel void sum_latitude_numbers(global const float* radiance, uint width, uint height, double scale,
                                 global const double* meridians, uint first, uint band, global double* moments) {
    const size_t at = get_global_id(0) / LATITUDE_ENTRY;
    if (at >= band) return;
    const uint number = (uint)(get_global_id(0) % LATITUDE_ENTRY);
    const uint kind = number / 4u;  // flat, cosine, sine
    const uint place = number % 4u;
    const bool is_difference = place == 3u;
    const uint channel = is_difference ? kind : place;
    const uint i = first + (uint)at;
    global const float* above = radiance + 3 * (size_t)width * (i == 0u ? 0u : i - 1u) + channel;
    global const float* below = radiance + 3 * (size_t)width * (i == height ? 0u : i) + channel;
    const double scale_above = i == 0u ? 0.0 : scale;
    const double scale_below = i == height ? 0.0 : scale;
    const double step = TWO_PI_D / width;
    global double* to = moments + LATITUDE_ENTRY * at * ((size_t)width + 1) + number;
    double sum = 0.0;
    double2 from = vload2(0, meridians);
    for (uint j = 0u; j < width; ++j) {
        const double2 until = vload2(j + 1u, meridians);
        const double d = below[3 * (size_t)j] * scale_below - above[3 * (size_t)j] * scale_above;
        const double value = kind == 0u ? sum - d * (step * j) : kind == 1u ? sum - d * from.y : sum + d * from.x;
        to[LATITUDE_ENTRY * (size_t)j] = is_difference ? d : value;
        sum += d * (kind == 0u ? step : kind == 1u ? until.y - from.y : from.x - until.x);
        from = until;
    }
    to[LATITUDE_ENTRY * (size_t)width] = is_difference ? 0.0 : sum;
}

/// Adds latitudes first .. first + band - 1 to every pixel.
///   sums [3 * stride]  planes: 2 E, added to
/// Range: one work-item per pixel. Latitudes are added in their order, so the result is the same for any range.
kernel void add_latitudes(global const double* frames, global const uint* ring, global const double* ring_y, uint stride,
                          global const double* crossing, global const double* latitudes,
                          global const double* meridians, uint width, global const double* moments, uint first,
                          uint band, global double* sums) {
    const size_t at = get_global_id(0);
    if (at >= stride) return;
    const PixelFrame f = load_frame(frames, at);
    const size_t r = ring[at];
    const double ny = ring_y[r];
    const double radians = TWO_PI_D / width;
    const double centred = 0.5 - corner_tolerance(width);
    const int w = (int)width;
    double4 flat = 0.0;
    double4 cosine = 0.0;
    double4 sine = 0.0;
    for (uint e = 0u; e < band; ++e) {
        const double4 k = vload4(r * band + e, crossing);
        if (k.x == WHOLLY_BELOW) continue;
        global const double* row = moments + LATITUDE_ENTRY * (size_t)e * (width + 1u);
        int turns = 1;
        if (k.x == WHOLLY_ABOVE) {
            global const double* cut = row + LATITUDE_ENTRY * (size_t)f.behind;
            flat.w += 2.0 * k.y * cut[3];
            cosine.w += 2.0 * k.y * cut[7];
            sine.w += 2.0 * k.y * cut[11];
        } else {
            const double x0 = f.azimuth - k.x;
            const double x1 = f.azimuth + k.x;
            // Moved to positive positions, where a conversion is a floor.
            int left = (int)(x0 + width) - w;
            int right = (int)x1;
            const double off_centre0 = fabs(x0 - left - 0.5);
            const double off_centre1 = fabs(x1 - right - 0.5);
            if ((off_centre0 > centred) | (off_centre1 > centred)) {
                const int2 settled =
                    settled_columns(ny, f, vload2(first + e, latitudes), meridians, left, right, w);
                left = settled.x;
                right = settled.y;
            }
            const int turns0 = turns_of(left, w);
            const int turns1 = turns_of(right, w);
            turns = turns1 - turns0;
            const double k0 = fma(k.z, (x0 - (double)turns0 * width) * radians, -k.y);
            const double k1 = fma(k.z, (x1 - (double)turns1 * width) * radians, k.y);
            global const double* p0 = row + LATITUDE_ENTRY * (size_t)(left - turns0 * w);
            global const double* p1 = row + LATITUDE_ENTRY * (size_t)(right - turns1 * w);
            const double4 until = (double4)(k.www, k1);
            const double4 from = -(double4)(k.www, k0);
            flat = fma((double4)(k.zzz, k1), vload4(0, p1), fma(-(double4)(k.zzz, k0), vload4(0, p0), flat));
            cosine = fma(until, vload4(1, p1), fma(from, vload4(1, p0), cosine));
            sine = fma(until, vload4(2, p1), fma(from, vload4(2, p0), sine));
        }
        global const double* whole = row + LATITUDE_ENTRY * (size_t)width;
        const double4 of_whole = (double4)((double)turns * k.w);
        flat = fma((double4)((double)turns * k.z), vload4(0, whole), flat);
        cosine = fma(of_whole, vload4(1, whole), cosine);
        sine = fma(of_whole, vload4(2, whole), sine);
    }
    const double3 sum = flat.xyz + f.nx * cosine.xyz + f.nz * sine.xyz + (double3)(flat.w, cosine.w, sine.w);
    sums[at] += sum.x;
    sums[(size_t)stride + at] += sum.y;
    sums[2 * (size_t)stride + at] += sum.z;
}

/// Prefix sums along meridians first .. first + band - 1: of the difference of radiance d (right less left) times
/// d(theta), such that value + d * theta is the sum down to theta. The last entry is the whole meridian's sum, d = 0.
///   moments [MERIDIAN_ENTRY * band * (height + 1)]
/// Range: one work-item per meridian.
kernel void sum_meridians(global const float* radiance, uint width, uint height, double scale, uint first, uint band,
                          global double* moments) {
    const size_t at = get_global_id(0);
    if (at >= band) return;
    const uint j = first + (uint)at;
    const uint before = j == 0u ? width - 1u : j - 1u;
    const double step = PI_D / height;
    global double* to = moments + MERIDIAN_ENTRY * at * ((size_t)height + 1);
    double3 sum = 0.0;
    for (uint i = 0u; i < height; ++i) {
        const double3 d =
            texel(radiance, (size_t)i * width + j, scale) - texel(radiance, (size_t)i * width + before, scale);
        vstore4((double4)(sum - d * (step * i), 0.0), 0, to);
        vstore4((double4)(d, 0.0), 1, to);
        sum += d * step;
        to += MERIDIAN_ENTRY;
    }
    vstore4((double4)(sum, 0.0), 0, to);
    vstore4((double4)(0.0), 1, to);
}

/// The same table by work-items in lock step, as sum_latitude_numbers. Equal to sum_meridians to the bit.
/// Range: one work-item per meridian and number of its entry, numbers side by side.
kernel void sum_meridian_numbers(global const float* radiance, uint width, uint height, double scale, uint first,
                                 uint band, global double* moments) {
    const size_t at = get_global_id(0) / MERIDIAN_ENTRY;
    if (at >= band) return;
    const uint number = (uint)(get_global_id(0) % MERIDIAN_ENTRY);
    const bool is_difference = number >= 4u;
    const uint channel = number % 4u;
    const bool is_padding = channel == 3u;
    const uint j = first + (uint)at;
    global const float* right = radiance + 3 * (size_t)j + (is_padding ? 0u : channel);
    global const float* left = radiance + 3 * (size_t)(j == 0u ? width - 1u : j - 1u) + (is_padding ? 0u : channel);
    const double step = PI_D / height;
    global double* to = moments + MERIDIAN_ENTRY * at * ((size_t)height + 1) + number;
    double sum = 0.0;
    for (uint i = 0u; i < height; ++i) {
        const size_t row = 3 * (size_t)width * i;
        const double d = is_padding ? 0.0 : right[row] * scale - left[row] * scale;
        to[MERIDIAN_ENTRY * (size_t)i] = is_difference ? d : sum - d * (step * i);
        sum += d * step;
    }
    to[MERIDIAN_ENTRY * (size_t)height] = is_difference ? 0.0 : sum;
}

/// Adds meridians first .. first + band - 1 to every pixel.
///   meridians [2 * (W + MERIDIANS_WIDE)]  cos(phi), sin(phi)
///   sums      [3 * stride]                planes: 2 E, added to
/// Range: one work-item per pixel. Meridians are added in their order, so the result is the same for any range.
kernel void add_meridians(global const double* frames, global const uint* ring, global const double* ring_y, uint stride,
                          global const double* latitudes, global const double* meridians, uint height,
                          global const double* moments, uint first, uint band, global double* sums) {
    const size_t at = get_global_id(0);
    if (at >= stride) return;
    const PixelFrame f = load_frame(frames, at);
    const double ny = ring_y[ring[at]];
    const double side = ny > 0.0 ? 1.0 : -1.0;
    const double rows = height / PI_D;
    const double centred = 0.5 - corner_tolerance(height);
    const long8 lane = (long8)(0, 1, 2, 3, 4, 5, 6, 7);
    double4 partial[4] = {(double4)(0.0), (double4)(0.0), (double4)(0.0), (double4)(0.0)};
    for (uint group = 0u; group < band; group += MERIDIANS_WIDE) {
        const double16 cs = vload16(0, meridians + 2 * ((size_t)first + group));
        // By name: oclgrind takes the lanes of .even and .odd for uninitialised, and no scalar beside a vector in min().
        const double8 c = (double8)(cs.s0, cs.s2, cs.s4, cs.s6, cs.s8, cs.sa, cs.sc, cs.se);
        const double8 s = (double8)(cs.s1, cs.s3, cs.s5, cs.s7, cs.s9, cs.sb, cs.sd, cs.sf);
        const double8 along = fma((double8)(f.nx), c, f.nz * s);
        const double8 across = fma((double8)(f.nx), s, -(f.nz * c));
        const double8 theta = upper_angle(-side * along, (double8)(fabs(ny)));
        const double8 psi = upper_angle(along, fabs(ny) * fabs(across));
        // Meridians beyond the band's last count nothing.
        const long8 taken = lane < (long)(band - group);
        const double8 value_factor = taken ? side * across : (double8)(0.0);
        const double8 turned = across < 0.0 ? -psi : psi;
        const double8 difference_factor = taken ? fma(value_factor, theta, turned) : (double8)(0.0);
        const double8 position = theta * rows;
        const int8 row = min(convert_int8(position), (int8)((int)height - 1));
        const long8 near = fabs(position - convert_double8(row) - 0.5) > centred;
        double value_of[MERIDIANS_WIDE], difference_of[MERIDIANS_WIDE];
        int row_of[MERIDIANS_WIDE];
        vstore8(value_factor, 0, value_of);
        vstore8(difference_factor, 0, difference_of);
        vstore8(row, 0, row_of);
        if (any(near)) {
            double along_of[MERIDIANS_WIDE];
            vstore8(along, 0, along_of);
            for (int k = 0; k < MERIDIANS_WIDE; ++k) {
                row_of[k] = settled_row(ny, along_of[k], latitudes, row_of[k], (int)height);
            }
        }
#pragma unroll
        for (int k = 0; k < MERIDIANS_WIDE; ++k) {
            const size_t column = (size_t)min(group + (uint)k, band - 1u) * (height + 1u);
            global const double* entry = moments + MERIDIAN_ENTRY * (column + row_of[k]);
            partial[2 * (k & 1)] = fma((double4)(value_of[k]), vload4(0, entry), partial[2 * (k & 1)]);
            partial[2 * (k & 1) + 1] = fma((double4)(difference_of[k]), vload4(1, entry), partial[2 * (k & 1) + 1]);
        }
        // Where the pixel looks down, the piece above the horizon is the rest of the meridian.
        if (ny < 0.0) {
#pragma unroll
            for (int k = 0; k < MERIDIANS_WIDE; ++k) {
                const size_t column = (size_t)min(group + (uint)k, band - 1u) * (height + 1u);
                global const double* whole = moments + MERIDIAN_ENTRY * (column + height);
                partial[k & 1] = fma((double4)(-value_of[k]), vload4(0, whole), partial[k & 1]);
            }
        }
    }
    const double4 sum = (partial[0] + partial[1]) + (partial[2] + partial[3]);
    sums[at] -= sum.x;
    sums[(size_t)stride + at] -= sum.y;
    sums[2 * (size_t)stride + at] -= sum.z;
}

/// Radiance of a white diffuse surface: E / pi.
///   unit_albedo_radiance [3 * stride]
/// Range: one work-item per pixel and channel.
kernel void finish_white(global const double* sums, uint count, global float* unit_albedo_radiance) {
    const size_t at = get_global_id(0);
    if (at >= count) return;
    unit_albedo_radiance[at] = convert_float(fmax(0.0, sums[at] * INVERSE_TWO_PI_D));
}
