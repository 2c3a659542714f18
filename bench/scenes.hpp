#pragma once

#include <cstddef>
#include <string>

#include "cl/device.hpp"
#include "image.hpp"
#include "tables/stage2_cdf.hpp"

namespace clerestory::bench {

/// What lights the scenes that are timed.
enum class Light : int {
    even,  ///< within a half of the same everywhere: every table and every texel is visited
    city,  ///< the bundled photograph; larger than 1024 x 512, each of its texels becomes a block of uneven ones
    suns,  ///< sixteen suns of 1e6 in a sky as `even`
};
const char* light_name(Light light);

/// A map with its tables on a device.
struct LitMap {
    LitMap(const Device& device, const RadianceMap& lit);
    const RadianceMap& map;
    DeviceMap on_device;
    Distribution distribution;
};

/// The scene on that many cores. Only the last one asked for is kept.
LitMap& lit_map(Light light, std::size_t width, std::size_t height, unsigned cores);
/// Its map alone.
const RadianceMap& bench_map(Light light, std::size_t width, std::size_t height);

/// A pseudo-random fraction of one; a pure function of `index`.
float hashed_fraction(std::size_t index);

}  // namespace clerestory::bench
