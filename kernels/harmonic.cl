#pragma OPENCL FP_CONTRACT OFF
#include "harmonic.clh"

/// Rows that one work-item transforms together: each load of a wave serves this many rows of three colours.
#ifndef ROWS_PER_ITEM
#define ROWS_PER_ITEM 4
#endif
/// Columns that are transformed at a time: a tile of all rows and colours fits into the first-level cache.
#ifndef TILE_COLUMNS
#define TILE_COLUMNS 512u
#endif
/// Registers of PIXELS_WIDE pixels that one work-item of evaluate_harmonics fills.
#ifndef HARMONIC_REGISTERS
#define HARMONIC_REGISTERS 2
#endif
#define PLANES (3 * ROWS_PER_ITEM)

#if PIXELS_WIDE == 16
/// Histogram of the map's intensities.
///   radiance [3 * height * width]      linear RGB, row-major, top row first
///   scale                              2^-exponent of the map
///   bins     [items * INTENSITY_BINS]  counts of each work-item's rows
/// Range: one work-item per `rows` rows. No local memory, no barrier. Exact.
kernel void count_intensities(global const float* radiance, uint width, uint height, uint rows, float scale,
                              global uint* bins) {
    const uint first = (uint)get_global_id(0) * rows;
    if (first >= height) return;
    global uint* own = bins + INTENSITY_BINS * get_global_id(0);
    for (uint b = 0u; b < INTENSITY_BINS; ++b) own[b] = 0u;
    const size_t end = (size_t)min(first + rows, height) * width;
    for (size_t at = (size_t)first * width; at < end; ++at) {
        const float intensity =
            mean_intensity(radiance[3 * at] * scale, radiance[3 * at + 1] * scale, radiance[3 * at + 2] * scale);
        own[intensity_bin(intensity)] += 1u;
    }
}

/// Number of texels above `threshold` in every row.
///   count [height]
/// Range: one work-item per row.
kernel void count_lights(global const float* radiance, uint width, uint height, float scale, float threshold,
                         global uint* count) {
    const uint row = (uint)get_global_id(0);
    if (row >= height) return;
    global const float* texels = radiance + 3 * (size_t)width * row;
    uint found = 0u;
    for (uint j = 0u; j < width; ++j) {
        found +=
            mean_intensity(texels[3 * j] * scale, texels[3 * j + 1] * scale, texels[3 * j + 2] * scale) > threshold;
    }
    count[row] = found;
}

/// What exceeds `threshold`, texel by texel in the map's order.
///   first  [height]     number of lights in the rows above
///   texel  [lights]     row * width + column
///   excess [3 * lights] R, G, B side by side, times 2^-exponent
/// Range: one work-item per row; rows without a light are passed over.
kernel void collect_lights(global const float* radiance, uint width, uint height, float scale, float threshold,
                           global const uint* first, global const uint* count, global uint* texel,
                           global float* excess) {
    const uint row = (uint)get_global_id(0);
    if (row >= height || count[row] == 0u) return;
    global const float* texels = radiance + 3 * (size_t)width * row;
    uint at = first[row];
    for (uint j = 0u; j < width; ++j) {
        const float r = texels[3 * j] * scale;
        const float g = texels[3 * j + 1] * scale;
        const float b = texels[3 * j + 2] * scale;
        const float taken = 1.0f - kept_part(mean_intensity(r, g, b), threshold);
        if (taken > 0.0f) {
            texel[at] = row * width + j;
            excess[3 * at] = r * taken;
            excess[3 * at + 1] = g * taken;
            excess[3 * at + 2] = b * taken;
            ++at;
        }
    }
}

/// Fourier sums over the columns of every row, of the map less its direct lights.
///   waves  [(degree + 1) * 2 * wave_stride]  cos(m phi), then sin(m phi), at the columns' centres; 0 past the width
///   sums   [height * (degree + 1) * 6]       for each m: cosine sums of R, G, B, then sine sums
///   square [3 * height]                      sums of the squares of R, G, B
/// Range: one work-item per ROWS_PER_ITEM rows. No local memory, no barrier.
/// Error: 1e-6 of the row's mean (measured in tests/harmonic_test.cpp).
kernel void sum_rows(global const float* radiance, uint width, uint height, float scale, float threshold,
                     global const float* waves, uint wave_stride, uint degree, global float* sums,
                     global float* square) {
    const uint first_row = (uint)get_global_id(0) * ROWS_PER_ITEM;
    if (first_row >= height) return;
    const uint rows = min((uint)ROWS_PER_ITEM, height - first_row);
    float tile[PLANES * TILE_COLUMNS];
    pixels_t squares[PLANES];
    for (int k = 0; k < PLANES; ++k) squares[k] = (pixels_t)(0.0f);
    for (uint first = 0u; first < width; first += TILE_COLUMNS) {
        const uint columns = min(TILE_COLUMNS, width - first);
        const uint registers = (columns + PIXELS_WIDE - 1u) / PIXELS_WIDE;
        for (uint i = 0u; i < ROWS_PER_ITEM; ++i) {
            // A row past the last one repeats it, and is not stored.
            global const float* from = radiance + 3 * ((size_t)width * (first_row + min(i, rows - 1u)) + first);
            float* red = tile + 3u * i * TILE_COLUMNS;
            float* green = red + TILE_COLUMNS;
            float* blue = green + TILE_COLUMNS;
            for (uint j = 0u; j < columns; ++j) {
                const float r = from[3 * j] * scale;
                const float g = from[3 * j + 1] * scale;
                const float b = from[3 * j + 2] * scale;
                const float kept = kept_part(mean_intensity(r, g, b), threshold);
                red[j] = r * kept;
                green[j] = g * kept;
                blue[j] = b * kept;
            }
            for (uint j = columns; j < registers * PIXELS_WIDE; ++j) red[j] = green[j] = blue[j] = 0.0f;
        }
#pragma unroll
        for (int k = 0; k < PLANES; ++k) {
            for (uint v = 0u; v < registers; ++v) {
                const pixels_t x = LOAD_PIXELS(v, tile + k * TILE_COLUMNS);
                squares[k] = fma(x, x, squares[k]);
            }
        }
        for (uint m = 0u; m <= degree; ++m) {
            global const float* cosines = waves + 2 * (size_t)m * wave_stride + first;
            global const float* sines = cosines + wave_stride;
            pixels_t c[PLANES], s[PLANES];
#pragma unroll
            for (int k = 0; k < PLANES; ++k) c[k] = s[k] = (pixels_t)(0.0f);
            for (uint v = 0u; v < registers; ++v) {
                const pixels_t cosine = LOAD_PIXELS(v, cosines);
                const pixels_t sine = LOAD_PIXELS(v, sines);
#pragma unroll
                for (int k = 0; k < PLANES; ++k) {
                    const pixels_t x = LOAD_PIXELS(v, tile + k * TILE_COLUMNS);
                    c[k] = fma(x, cosine, c[k]);
                    s[k] = fma(x, sine, s[k]);
                }
            }
#pragma unroll
            for (int k = 0; k < PLANES; ++k) {
                const uint row = (uint)k / 3u;
                if (row < rows) {
                    global float* to = sums + 6 * ((size_t)(first_row + row) * (degree + 1u) + m) + (uint)k % 3u;
                    to[0] = sum_lanes(c[k]) + (first == 0u ? 0.0f : to[0]);
                    to[3] = sum_lanes(s[k]) + (first == 0u ? 0.0f : to[3]);
                }
            }
        }
    }
#pragma unroll
    for (int k = 0; k < PLANES; ++k) {
        if ((uint)k / 3u < rows) square[3 * (size_t)first_row + (uint)k] = sum_lanes(squares[k]);
    }
}
#else
// The same for work-items in lock step.

/// Histogram of the map's intensities.
///   radiance [3 * height * width]     linear RGB, row-major, top row first
///   scale                             2^-exponent of the map
///   bins     [sets * INTENSITY_BINS]  counts, 0 before; work-items share the sets out, so that few meet at one place
/// Range: any number of work-items; each takes every one of its own distance apart. Exact: integers in any order.
kernel void count_intensities_in_step(global const float* radiance, uint texels, uint items, float scale, uint sets,
                                      volatile global uint* bins) {
    const uint item = (uint)get_global_id(0);
    if (item >= items) return;
    volatile global uint* own = bins + INTENSITY_BINS * (size_t)(get_group_id(0) % sets);
    for (size_t at = item; at < texels; at += items) {
        const float intensity =
            mean_intensity(radiance[3 * at] * scale, radiance[3 * at + 1] * scale, radiance[3 * at + 2] * scale);
        atomic_inc(own + intensity_bin(intensity));
    }
}

/// What exceeds `threshold`, in no order: each work-item takes the next free place.
///   found  [1]         texels so far, 0 before; counted on past `room`, which tells the host how much it takes
///   texel  [room]      row * width + column
///   excess [3 * room]  R, G, B side by side, times 2^-exponent
/// Range: one work-item per texel.
kernel void collect_lights_in_step(global const float* radiance, uint texels, float scale, float threshold, uint room,
                                   volatile global uint* found, global uint* texel, global float* excess) {
    const size_t at = get_global_id(0);
    if (at >= texels) return;
    const float r = radiance[3 * at] * scale;
    const float g = radiance[3 * at + 1] * scale;
    const float b = radiance[3 * at + 2] * scale;
    const float taken = 1.0f - kept_part(mean_intensity(r, g, b), threshold);
    if (!(taken > 0.0f)) return;
    const size_t place = atomic_inc(found);
    if (place >= room) return;
    texel[place] = (uint)at;
    excess[3 * place] = r * taken;
    excess[3 * place + 1] = g * taken;
    excess[3 * place + 2] = b * taken;
}

/// Columns that are added in float32 before their sum joins the row's: bounds the rounding of long rows.
#define COLUMNS_PER_BLOCK 64u

/// What sum_rows computes where work-items are fat: Fourier sums of every row, and its squares.
///   waves  [2 * (degree + 1) * width]  for each column: cos(m phi), then sin(m phi), at its centre, m = 0 .. degree
/// Range: one work-item per row and m, those of a row side by side: they read the same texel and neighbouring waves.
/// Error: 1e-6 of the row's mean (measured in tests/harmonic_test.cpp).
kernel void sum_rows_in_step(global const float* radiance, uint width, uint height, float scale, float threshold,
                             global const float* waves, uint degree, global float* sums, global float* square) {
    const uint orders = degree + 1u;
    const uint row = (uint)get_global_id(0) / orders;
    const uint m = (uint)get_global_id(0) % orders;
    if (row >= height) return;
    global const float* from = radiance + 3 * (size_t)width * row;
    float3 cosines = (float3)(0.0f);
    float3 sines = (float3)(0.0f);
    float3 squares = (float3)(0.0f);
    for (uint first = 0u; first < width; first += COLUMNS_PER_BLOCK) {
        const uint last = min(first + COLUMNS_PER_BLOCK, width);
        float3 c = (float3)(0.0f);
        float3 s = (float3)(0.0f);
        float3 q = (float3)(0.0f);
        for (uint j = first; j < last; ++j) {
            const float r = from[3 * j] * scale;
            const float g = from[3 * j + 1] * scale;
            const float b = from[3 * j + 2] * scale;
            const float3 x = (float3)(r, g, b) * kept_part(mean_intensity(r, g, b), threshold);
            global const float* wave = waves + 2 * (size_t)orders * j + m;
            c = fma(x, (float3)(wave[0]), c);
            s = fma(x, (float3)(wave[orders]), s);
            q = fma(x, x, q);
        }
        cosines += c;
        sines += s;
        squares += q;
    }
    global float* to = sums + 6 * ((size_t)row * orders + m);
    to[0] = cosines.x;
    to[1] = cosines.y;
    to[2] = cosines.z;
    to[3] = sines.x;
    to[4] = sines.y;
    to[5] = sines.z;
    if (m == 0u) {
        square[3 * (size_t)row] = squares.x;
        square[3 * (size_t)row + 1] = squares.y;
        square[3 * (size_t)row + 2] = squares.z;
    }
}
#endif

/// Adds the functions of order m to the sums of HARMONIC_REGISTERS registers of pixels, and turns cosine and sine of
/// m phi, times sin(theta)^m, on to the next order. Returns where that one's terms begin.
INLINE global const float* add_order(global const float* next, uint m, uint degree, const pixels_t* x, const pixels_t* y,
                                     const pixels_t* z, pixels_t* cosine, pixels_t* sine, pixels_t* red,
                                     pixels_t* green, pixels_t* blue) {
    pixels_t before[HARMONIC_REGISTERS], here[HARMONIC_REGISTERS];
    pixels_t cr[HARMONIC_REGISTERS], cg[HARMONIC_REGISTERS], cb[HARMONIC_REGISTERS];
    pixels_t sr[HARMONIC_REGISTERS], sg[HARMONIC_REGISTERS], sb[HARMONIC_REGISTERS];
    const float start = next[0];
    next += 1;
#pragma unroll
    for (int k = 0; k < HARMONIC_REGISTERS; ++k) {
        before[k] = (pixels_t)(0.0f);
        here[k] = (m & 1u) != 0u ? start * y[k] : (pixels_t)(start);
        cr[k] = cg[k] = cb[k] = sr[k] = sg[k] = sb[k] = (pixels_t)(0.0f);
    }
    for (uint l = m + (m & 1u); l <= degree; l += 2u) {
#pragma unroll
        for (int k = 0; k < HARMONIC_REGISTERS; ++k) {
            cr[k] = fma(here[k], (pixels_t)(next[3]), cr[k]);
            cg[k] = fma(here[k], (pixels_t)(next[4]), cg[k]);
            cb[k] = fma(here[k], (pixels_t)(next[5]), cb[k]);
            sr[k] = fma(here[k], (pixels_t)(next[6]), sr[k]);
            sg[k] = fma(here[k], (pixels_t)(next[7]), sg[k]);
            sb[k] = fma(here[k], (pixels_t)(next[8]), sb[k]);
            const pixels_t after = fma(fma(y[k] * y[k], (pixels_t)(next[0]), (pixels_t)(next[1])), here[k],
                                       before[k] * next[2]);
            before[k] = here[k];
            here[k] = after;
        }
        next += 9;
    }
#pragma unroll
    for (int k = 0; k < HARMONIC_REGISTERS; ++k) {
        red[k] = fma(cosine[k], cr[k], fma(sine[k], sr[k], red[k]));
        green[k] = fma(cosine[k], cg[k], fma(sine[k], sg[k], green[k]));
        blue[k] = fma(cosine[k], cb[k], fma(sine[k], sb[k], blue[k]));
        const pixels_t turned = fma(cosine[k], x[k], -(sine[k] * z[k]));
        sine[k] = fma(cosine[k], z[k], sine[k] * x[k]);
        cosine[k] = turned;
    }
    return next;
}

/// A harmonic series at every pixel's normal.
///   normal [3 * stride]  three planes, unit length
///   terms                9 floats: x, y, z parts of degree 1 for R, G, B; then for each m = 0 .. degree: the value of
///                        the least even degree's function over (sin theta)^m (and over y where m is odd); then for
///                        each even degree from m up: A, B, C of the step Q+2 = (A y^2 + B) Q + C Q-2, and six
///                        coefficients: cosine parts of R, G, B, then sine parts
///   add                  1: added to what stands in `unit_albedo_radiance`
///   clamped              1: the result is at least 0
///   unit_albedo_radiance  [3 * stride]  three planes: R, G, B
/// Range: one work-item per PIXELS_WIDE * HARMONIC_REGISTERS pixels; stride is a multiple of that. No barrier.
/// Error: 2e-6 of the mean up to degree 40 (measured in tests/harmonic_test.cpp).
/// Source: recurrences of the normalised associated Legendre functions, two degrees at a step because odd degrees
/// above 1 do not light a diffuse surface: Ramamoorthi, Hanrahan, An Efficient Representation for Irradiance
/// Environment Maps, 2001.
kernel void evaluate_harmonics(global const float* normal, global const float* terms, uint degree, uint stride,
                               uint items, uint add, uint clamped, global float* unit_albedo_radiance) {
    const size_t item = get_global_id(0);
    if (item >= items) return;
    pixels_t x[HARMONIC_REGISTERS], y[HARMONIC_REGISTERS], z[HARMONIC_REGISTERS];
    pixels_t cosine[HARMONIC_REGISTERS], sine[HARMONIC_REGISTERS];
    pixels_t red[HARMONIC_REGISTERS], green[HARMONIC_REGISTERS], blue[HARMONIC_REGISTERS];
#pragma unroll
    for (int k = 0; k < HARMONIC_REGISTERS; ++k) {
        const size_t at = REGISTER_OF(item, items, k, HARMONIC_REGISTERS);
        x[k] = LOAD_PIXELS(at, normal);
        y[k] = LOAD_PIXELS(at, normal + stride);
        z[k] = LOAD_PIXELS(at, normal + 2 * (size_t)stride);
        red[k] = fma(x[k], (pixels_t)(terms[0]), fma(y[k], (pixels_t)(terms[1]), z[k] * terms[2]));
        green[k] = fma(x[k], (pixels_t)(terms[3]), fma(y[k], (pixels_t)(terms[4]), z[k] * terms[5]));
        blue[k] = fma(x[k], (pixels_t)(terms[6]), fma(y[k], (pixels_t)(terms[7]), z[k] * terms[8]));
        cosine[k] = (pixels_t)(1.0f);
        sine[k] = (pixels_t)(0.0f);
    }
    global const float* next = terms + 9;
    for (uint m = 0u; m <= degree; ++m) next = add_order(next, m, degree, x, y, z, cosine, sine, red, green, blue);
    const pixels_t least = (pixels_t)(clamped != 0u ? 0.0f : -INFINITY);
#pragma unroll
    for (int k = 0; k < HARMONIC_REGISTERS; ++k) {
        const size_t at = REGISTER_OF(item, items, k, HARMONIC_REGISTERS);
        if (add != 0u) {
            red[k] += LOAD_PIXELS(at, unit_albedo_radiance);
            green[k] += LOAD_PIXELS(at, unit_albedo_radiance + stride);
            blue[k] += LOAD_PIXELS(at, unit_albedo_radiance + 2 * (size_t)stride);
        }
        STORE_PIXELS(fmax(red[k], least), at, unit_albedo_radiance);
        STORE_PIXELS(fmax(green[k], least), at, unit_albedo_radiance + stride);
        STORE_PIXELS(fmax(blue[k], least), at, unit_albedo_radiance + 2 * (size_t)stride);
    }
}

/// Registers of lights that one work-item of project_lights takes: LIGHT_REGISTERS * PIXELS_WIDE lights.
#ifndef LIGHT_REGISTERS
#define LIGHT_REGISTERS 16
#endif
/// Place of register v of a work-item's own, among those of all lights.
#define LIGHT_PLACE(v) REGISTER_OF(item, (size_t)items, v, LIGHT_REGISTERS)
/// Place of number k of a work-item's sums: beside its other ones, or in lock step beside its neighbours'.
#define SUM_PLACE(k) REGISTER_OF(item, (size_t)items, k, size)

/// Sums over lights of weight times harmonic: the coefficients of light that comes from single directions.
///   light [6 * light_stride]  planes x, y, z, weights of R, G, B; zeros from the last light on
///   terms                     as in evaluate_harmonics, of which the values and steps are read
///   sums  [items * size]      SUM_PLACE of each number, in the layout of terms: for R, G, B the sums of weight times x, y, z; then in the place of
///                             each six coefficients the sums of weight times function and cosine, of R, G, B, then
///                             times sine. Other places are not written.
/// Range: one work-item per LIGHT_REGISTERS * PIXELS_WIDE lights. No local memory, no barrier.
/// Error: 1.5e-6 of the weights' sum at degree 8, 3.4e-6 at degree 40 (bounds of tests/lights_test.cpp).
kernel void project_lights(global const float* light, uint light_stride, global const float* terms, uint degree,
                           uint items, uint size, global float* sums) {
    const size_t item = get_global_id(0);
    if (item >= items) return;
    const size_t stride = light_stride;
    uint registers = 0u;
    while (registers < LIGHT_REGISTERS && LIGHT_PLACE(registers) < stride / PIXELS_WIDE) ++registers;
    for (uint c = 0u; c < 3u; ++c) {
        pixels_t along[3] = {(pixels_t)(0.0f), (pixels_t)(0.0f), (pixels_t)(0.0f)};
        for (uint v = 0u; v < registers; ++v) {
            const pixels_t w = LOAD_PIXELS(LIGHT_PLACE(v), light + (3 + c) * stride);
#pragma unroll
            for (uint d = 0u; d < 3u; ++d) along[d] = fma(w, LOAD_PIXELS(LIGHT_PLACE(v), light + d * stride), along[d]);
        }
        for (uint d = 0u; d < 3u; ++d) sums[SUM_PLACE(3u * c + d)] = sum_lanes(along[d]);
    }
    pixels_t cosine[LIGHT_REGISTERS], sine[LIGHT_REGISTERS], before[LIGHT_REGISTERS], here[LIGHT_REGISTERS];
    pixels_t weight[LIGHT_REGISTERS][6];
    for (uint v = 0u; v < registers; ++v) {
        cosine[v] = (pixels_t)(1.0f);
        sine[v] = (pixels_t)(0.0f);
    }
    uint next = 9u;
    for (uint m = 0u; m <= degree; ++m) {
        const float start = terms[next++];
        for (uint v = 0u; v < registers; ++v) {
            before[v] = (pixels_t)(0.0f);
            here[v] = (m & 1u) != 0u ? start * LOAD_PIXELS(LIGHT_PLACE(v), light + stride) : (pixels_t)(start);
#pragma unroll
            for (uint c = 0u; c < 3u; ++c) {
                const pixels_t w = LOAD_PIXELS(LIGHT_PLACE(v), light + (3 + c) * stride);
                weight[v][c] = w * cosine[v];
                weight[v][3 + c] = w * sine[v];
            }
        }
        for (uint l = m + (m & 1u); l <= degree; l += 2u) {
            pixels_t sum[6];
#pragma unroll
            for (uint c = 0u; c < 6u; ++c) sum[c] = (pixels_t)(0.0f);
            for (uint v = 0u; v < registers; ++v) {
                const pixels_t y = LOAD_PIXELS(LIGHT_PLACE(v), light + stride);
#pragma unroll
                for (uint c = 0u; c < 6u; ++c) sum[c] = fma(here[v], weight[v][c], sum[c]);
                const pixels_t after = fma(fma(y * y, (pixels_t)(terms[next]), (pixels_t)(terms[next + 1u])), here[v],
                                           before[v] * terms[next + 2u]);
                before[v] = here[v];
                here[v] = after;
            }
#pragma unroll
            for (uint c = 0u; c < 6u; ++c) sums[SUM_PLACE(next + 3u + c)] = sum_lanes(sum[c]);
            next += 9u;
        }
        for (uint v = 0u; v < registers; ++v) {
            const pixels_t x = LOAD_PIXELS(LIGHT_PLACE(v), light);
            const pixels_t z = LOAD_PIXELS(LIGHT_PLACE(v), light + 2 * stride);
            const pixels_t turned = fma(cosine[v], x, -(sine[v] * z));
            sine[v] = fma(cosine[v], z, sine[v] * x);
            cosine[v] = turned;
        }
    }
}
