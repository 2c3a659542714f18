#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "cl/buffer.hpp"
#include "cl/device.hpp"
#include "options.hpp"
#include "shared_types.h"
#include "tables/stage2_cdf.hpp"

namespace clerestory {

/// Samples on the device, an array a field.
struct SampleSet {
    std::size_t count = 0;
    Buffer<cl_uint> texel;       ///< [count], row * width + column
    Buffer<cl_float> direction;  ///< [3 * count], planes x, y, z; unit length, the rotation applied
    Buffer<cl_float> pdf;        ///< [count], per steradian
    Buffer<cl_float> radiance;   ///< [3 * count], planes R, G, B; as in the map
};

/// 2^-exponent; an exponent of a distribution lies within -126 .. 126.
float map_scale(const Distribution& distribution);

/// 1 / (pi N), what each of N samples counts in the radiance of a surface of albedo 1.
float sample_share(std::size_t count);

/// How a point's place in the tables is found; the results are the same.
enum class Search { guided, plain };

/// Compile-time choices of kernels that draw from `distribution`.
std::string draw_defines(const Distribution& distribution, const SamplingOptions& options,
                         Search search = Search::guided);

/// Cells of a stratified set of `count` points: columns and cells a column as near to each other as they come.
Strata strata(std::size_t count);

/// What kernels that draw take beside the tables.
///   count  samples of the whole set, which `stratified` must know
DrawSettings draw_settings(const Distribution& distribution, const SamplingOptions& options, std::size_t count);

/// Draws from one distribution; the kernels are compiled once, when it is made.
class Sampler {
  public:
    /// The map and the distribution must outlive it.
    Sampler(const Device& device, const DeviceMap& map, const Distribution& distribution,
            const SamplingOptions& options, Search search = Search::guided);
    Sampler(Sampler&&) noexcept;
    Sampler& operator=(Sampler&&) noexcept;
    ~Sampler();

    /// Samples first .. first + count - 1 of the shared stream. `first` is even, count below 2^31.
    ///   total  samples of the whole set, which `stratified` must know; 0: it ends here
    SampleSet draw(std::size_t count, std::size_t first = 0, std::size_t total = 0);
    /// The same, into memory that stands already.
    void draw_into(SampleSet& set, std::size_t first = 0, std::size_t total = 0);
    /// Draws another set from now on, as a new sampler of this seed would.
    void reseed(std::uint64_t seed) noexcept;
    /// Turns the map from now on, as a new sampler of this rotation would; tables and harmonics serve every rotation.
    void rotate(double rotate_y_deg) noexcept;
    /// Memory for `count` samples.
    [[nodiscard]] SampleSet allocate(std::size_t count) const;

    /// Texels of given points (pairs of 32-bit fractions), and how far each lies through its row and column.
    struct Located {
        std::vector<cl_uint> texel;
        std::vector<cl_float> within;
    };
    Located locate(std::span<const cl_uint> points);

    [[nodiscard]] const SamplingOptions& options() const noexcept;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clerestory
