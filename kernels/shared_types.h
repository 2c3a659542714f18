// Types and constants that the kernels and the host share. Formulas are not shared: each side has its own.
#ifndef CLERESTORY_SHARED_TYPES_H
#define CLERESTORY_SHARED_TYPES_H

#ifdef __OPENCL_VERSION__
typedef uint shared_uint;
typedef ulong shared_ulong;
#else
#include <CL/cl.h>
namespace clerestory {
typedef cl_uint shared_uint;
typedef cl_ulong shared_ulong;
#endif

// A cumulative table counts in units of 2^-31, so that its end, one, fits into 32 bits beside every smaller value.
#define TABLE_BITS 31
#define TABLE_ONE 0x80000000u

// Fixed point of a texel's intensity within its row: units of 2^-29 of the row's scale, which leaves room for a row
// whose largest component is 4 after scaling.
#define WEIGHT_BITS 29

// What the counts of a row may lose to rounding in float32: a product is off by 2^-24 of itself, their sum by 2^7.
#define ROUNDING_MARGIN 256u

// Texels of a chunk, where a row is cut for several work-items.
#define CHUNK_TEXELS 4096u

// Bins of intensities by their leading bits: what is left of a float from 0 to 4 shifted by INTENSITY_SHIFT bits; 32
// bins for each power of two.
#define INTENSITY_SHIFT 18
#define INTENSITY_BINS 4160u

// First word of a random stream's domain, so that no two uses share numbers.
#define DOMAIN_SHARED 0u
#define DOMAIN_PER_PIXEL 1u

// Where points come from: a compile-time choice of the kernels, and the last word of a random stream's counter.
#define SEQUENCE_RANDOM 0u
#define SEQUENCE_STRATIFIED 1u
#define SEQUENCE_SOBOL 2u

// What is wrong with a map's texels, and its brightest component. One a row, or one a chunk.
//   first_bad: column of the first texel that is NaN, infinite or negative; width where there is none
typedef struct {
    shared_uint nan_count;
    shared_uint inf_count;
    shared_uint negative_count;
    shared_uint zero_count;
    shared_uint first_bad;
    float max_component;
} TexelCounts;

// A row's exact sum of intensities: sum * 2^(exponent - WEIGHT_BITS), over `lit` texels.
typedef struct {
    shared_ulong sum;
    int exponent;
    shared_uint lit;
} RowWeight;

// Where a row lies on the sphere, from the nearer pole, which keeps full precision there.
//   cap         sin^2(theta / 2) at the edge nearer the pole
//   cap_step    its increase to the other edge
//   pole        +1 where that pole is +y, -1 where it is -y
//   solid_angle of one texel, steradian
typedef struct {
    float cap;
    float cap_step;
    float pole;
    float solid_angle;
} RowFrame;

// Strata of a set of N points, N of any kind: the unit square cut into columns of `cells` or `cells` + 1 cells, each
// column as wide as its share of the cells, so that every cell has the area 1/N. Point k lies in cell k, column by
// column, the taller columns first.
//   point_step  2^64 / N, rounded down and held to 64 bits, as are the next two
//   cell_step   2^64 / cells
//   tall_step   2^64 / (cells + 1)
//   tall_points points in the taller columns
typedef struct {
    shared_ulong point_step;
    shared_ulong cell_step;
    shared_ulong tall_step;
    shared_uint tall_points;
    shared_uint cells;
} Strata;

// What a draw takes beside its tables: their shape, the map's rotation in full turns, and whose stream of points.
typedef struct {
    shared_uint width;
    shared_uint height;
    shared_uint row_bits;
    shared_uint column_bits;
    float inverse_width;
    float rotation;
    shared_uint seed_low;
    shared_uint seed_high;
    Strata strata;
} DrawSettings;

#ifndef __OPENCL_VERSION__
}  // namespace clerestory
#endif

#endif
