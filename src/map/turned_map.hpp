#pragma once

#include <cstddef>

#include "image.hpp"

namespace clerestory {

/// The map as it is after a rotation about +y: light of direction phi goes to phi + `rotate_y_deg`. Columns roll to the
/// right; where the angle is no whole number of columns, a column is the mean of the two that it covers, by their
/// shares.
RadianceMap turned_map(const RadianceMap& map, double rotate_y_deg);

/// Side of the squares of texels that become one, so that at most `columns` columns are left.
std::size_t shrink_factor(const RadianceMap& map, std::size_t columns);

/// Means over squares of `factor` texels, cut off at the map's edges.
RadianceMap shrunk_map(const RadianceMap& map, std::size_t factor);

}  // namespace clerestory
