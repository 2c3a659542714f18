#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "cl/buffer.hpp"
#include "cl/device.hpp"
#include "image.hpp"
#include "options.hpp"
#include "shading/pixels.hpp"

namespace clerestory {

/// Turns results into pictures.
class Display {
  public:
    explicit Display(const Device& device);
    Display(Display&&) noexcept;
    Display& operator=(Display&&) noexcept;
    ~Display();

    /// The picture of an estimator's result, times `gain` (albedo and the environment's scale) and 2^exponent.
    ///   returns [4 * size * size]  RGBA, black with alpha 0 beside the sphere
    std::vector<float> compose(const SphereView& view, const Buffer<cl_float>& unit_albedo_radiance, double gain,
                               int exponent);

    /// Preview bytes of an image of 3 or 4 interleaved channels.
    ///   returns [pixels], four bytes each, R lowest
    std::vector<cl_uint> preview(std::span<const float> pixels, std::size_t channels, const ToneOptions& tone);

    /// Preview of a map with every sample's texel marked by a 5x5 green square, clipped at the edges.
    ///   texel  [count]  of SampleSet
    std::vector<cl_uint> marked_preview(const RadianceMap& map, double scale, const ToneOptions& tone,
                                        const Buffer<cl_uint>& texel);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clerestory
