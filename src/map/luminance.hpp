#pragma once

#include <array>

#include "options.hpp"

namespace clerestory {

/// Weights of R, G and B in the intensity.
std::array<double, 3> luminance_weights(Luminance luminance);
/// The same, rounded to what the kernels take.
std::array<float, 3> luminance_weights_f32(Luminance luminance);

}  // namespace clerestory
