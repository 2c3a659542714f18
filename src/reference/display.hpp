#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace clerestory::reference {

/// 255 clamp(exposure radiance, 0, 1)^(1/gamma), not yet rounded; NaN gives 0.
long double tone(long double radiance, long double exposure, long double gamma);

/// Which pixels of a width x height picture a 5x5 square about any of `texels` covers.
///   returns [height * width], 1 where one does
std::vector<std::uint8_t> marked(std::span<const std::uint32_t> texels, std::size_t width, std::size_t height);

}  // namespace clerestory::reference
