#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "cl/buffer.hpp"
#include "cl/device.hpp"
#include "distribution.hpp"
#include "options.hpp"
#include "samples.hpp"

namespace clerestory {

/// The pixels of an S x S picture that show the sphere, with their normals: what every estimator works on. They stand
/// along a Hilbert curve, so that every GROUP_PIXELS of them lie together and have normals alike.
/// Arrays on the device are padded to `stride` with the normal (0, 0, 1).
struct SphereView {
    SphereView(const Device& device, std::size_t size);

    std::size_t size = 0;
    std::size_t count = 0;    ///< pixels of the sphere
    std::size_t stride = 0;   ///< `count` padded to a multiple of GROUP_PIXELS
    Buffer<cl_uint> pixel;    ///< [stride], row * size + column
    Buffer<cl_float> normal;  ///< [3 * stride], planes x, y, z
    /// [4 * stride / GROUP_PIXELS], a cone about the normals of each group: axis x, y, z, then the sine of the half
    /// angle with a margin for rounding; above 1 where the half angle is 90 degrees or more.
    Buffer<cl_float> cone;

    /// Largest number of pixels that any kernel gives to one work-item.
    static constexpr std::size_t GROUP_PIXELS = 256;

    /// Memory for an estimator's result: radiance of a white surface, in the map's scale 2^-exponent.
    ///   [3 * stride], planes R, G, B
    [[nodiscard]] Buffer<cl_float> planes(const Device& device) const;
};

/// Lights every pixel with one shared set of samples.
class SharedShader {
  public:
    explicit SharedShader(const Device& device);
    SharedShader(SharedShader&&) noexcept;
    SharedShader& operator=(SharedShader&&) noexcept;
    ~SharedShader();

    /// Draws `count` samples, in batches that bound the memory, and shades with them.
    ///   white  as SphereView::planes
    void shade(Sampler& sampler, const Distribution& distribution, const SphereView& view, std::size_t count,
               Buffer<cl_float>& white);

    /// Seconds of the last shade() spent drawing; the rest of it is shading.
    [[nodiscard]] double drawing_seconds() const noexcept;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Lights every pixel with a fresh set of samples.
class PerPixelShader {
  public:
    /// The map and the distribution must outlive it. Throws InputError where the map is black.
    PerPixelShader(const Device& device, const DeviceMap& map, const Distribution& distribution,
                   const SamplingOptions& options);
    PerPixelShader(PerPixelShader&&) noexcept;
    PerPixelShader& operator=(PerPixelShader&&) noexcept;
    ~PerPixelShader();

    void shade(const SphereView& view, std::size_t count, Buffer<cl_float>& white);
    /// Draws other sets from now on, as a new shader of this seed would.
    void reseed(std::uint64_t seed) noexcept;
    /// Turns the map from now on, as a new shader of this rotation would.
    void rotate(double rotate_y_deg) noexcept;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

/// Turns results into pictures.
class Display {
  public:
    explicit Display(const Device& device);
    Display(Display&&) noexcept;
    Display& operator=(Display&&) noexcept;
    ~Display();

    /// The picture of an estimator's result, times `gain` (albedo and the environment's scale) and 2^exponent.
    ///   returns [4 * size * size]  RGBA, black with alpha 0 beside the sphere
    std::vector<float> compose(const SphereView& view, const Buffer<cl_float>& white, double gain, int exponent);

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
