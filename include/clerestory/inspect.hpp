#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "clerestory/export.hpp"
#include "clerestory/image.hpp"
#include "clerestory/options.hpp"

namespace clerestory {

/// How many texels have a property, and where the first one lies.
struct TexelCount {
    std::uint64_t count = 0;
    std::size_t row = 0;
    std::size_t column = 0;
};

/// What a map holds, counted and summed in double on the host. Each texel counts once: NaN before infinite before
/// negative before zero; sums leave the first three out.
struct CLERESTORY_API MapFacts {
    TexelCount nan;
    TexelCount inf;
    TexelCount negative;
    TexelCount zero;
    double phi = 0;            ///< integral of intensity over the sphere
    double max_intensity = 0;  ///< of one texel
    double min_intensity = 0;  ///< of one lit texel; 0 where none is lit
    std::size_t max_row = 0;   ///< of the brightest texel
    std::size_t max_column = 0;
    std::array<double, 3> mean_rgb = {};  ///< over the sphere, by solid angle
    [[nodiscard]] std::uint64_t bad() const noexcept { return nan.count + inf.count + negative.count; }
    /// log2 of the brightest lit texel over the dimmest.
    [[nodiscard]] double stops() const;
};

CLERESTORY_API MapFacts inspect(const RadianceMap& map, Luminance luminance = Luminance::average);

}  // namespace clerestory
