#pragma once

#include <cstddef>

#include "cl/buffer.hpp"
#include "cl/device.hpp"

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

}  // namespace clerestory
