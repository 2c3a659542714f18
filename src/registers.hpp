#pragma once

#include <cstddef>

#include "cl/device.hpp"

namespace clerestory {

/// Values side by side in a register of a kernel's, where it names them itself (kernels/pixels.clh): PIXELS_WIDE.
constexpr std::size_t PIXELS_WIDE_ON_CPU = 16;
inline std::size_t pixels_wide_on(const Device& device) { return device.info().is_cpu ? PIXELS_WIDE_ON_CPU : 1; }

}  // namespace clerestory
