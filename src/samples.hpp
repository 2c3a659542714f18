#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "cl/buffer.hpp"
#include "cl/device.hpp"
#include "distribution.hpp"
#include "options.hpp"
#include "shared_types.h"

namespace clerestory {

class HarmonicShader;
struct HarmonicLight;

/// Samples on the device, an array a field.
struct SampleSet {
    std::size_t count = 0;
    Buffer<cl_uint> texel;       ///< [count], row * width + column
    Buffer<cl_float> direction;  ///< [3 * count], planes x, y, z; unit length, the rotation applied
    Buffer<cl_float> pdf;        ///< [count], per steradian
    Buffer<cl_float> radiance;   ///< [3 * count], planes R, G, B; as in the map
};

/// Compile-time choices of kernels that draw from `distribution`.
std::string draw_defines(const Distribution& distribution, const SamplingOptions& options);

/// Cells of a stratified set of `count` points: columns and cells a column as near to each other as they come.
Strata strata(std::size_t count);

/// `rotate_y_deg` as a part of a full turn, in [0, 1).
float rotation_turns(double rotate_y_deg);

/// Draws from one distribution; the kernels are compiled once, when it is made.
class Sampler {
  public:
    /// The map and the distribution must outlive it.
    Sampler(const Device& device, const DeviceMap& map, const Distribution& distribution,
            const SamplingOptions& options);
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
    /// The control variate's harmonics; projected by `shader` when first asked for.
    const HarmonicLight& control(HarmonicShader& shader);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clerestory
