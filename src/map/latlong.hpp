#pragma once

#include <cstddef>
#include <vector>

#include "shared_types.h"

namespace clerestory {

/// Where the map's rows lie on the sphere; computed in double, rounded once.
struct RowGeometry {
    std::vector<RowFrame> frames;  ///< [height]
    std::vector<float> sine;       ///< [height], sin(theta) at the row's centre
};
RowGeometry row_geometry(std::size_t width, std::size_t height);

/// Solid angle of a texel of each row, steradian, in double.
std::vector<double> texel_solid_angles(std::size_t width, std::size_t height);

}  // namespace clerestory
