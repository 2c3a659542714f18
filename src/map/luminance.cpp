#include "map/luminance.hpp"

namespace clerestory {

std::array<double, 3> luminance_weights(Luminance luminance) {
    // Rec. ITU-R BT.709-6, item 3.2.
    if (luminance == Luminance::rec709) return {0.2126, 0.7152, 0.0722};
    return {1.0 / 3, 1.0 / 3, 1.0 / 3};
}

std::array<float, 3> luminance_weights_f32(Luminance luminance) {
    const auto weights = luminance_weights(luminance);
    return {static_cast<float>(weights[0]), static_cast<float>(weights[1]), static_cast<float>(weights[2])};
}

}  // namespace clerestory
