#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "draw/colour_map.hpp"

namespace clerestory {

/// Values of a square picture as colours. A colour's strength goes with the root of the value, so that a tenth of the
/// limit still shows.
struct Panel {
    std::string title;
    std::string note;           ///< a line below
    std::vector<float> values;  ///< [size * size]; NaN where nothing is shown
    std::size_t size = 0;
    ColourMap map = ColourMap::diverging;
};

/// Panels in a grid, with a scale bar for each colour map in use.
struct PanelSheet {
    std::string name;  ///< leads every id, so that many sheets fit in one page
    std::string title;
    std::vector<Panel> panels;
    std::size_t columns = 3;
    double limit = 1;  ///< values of this size and above have the strongest colour
    std::string diverging_label = "error";
    std::string sequential_label = "spread";
};

/// As the function of this name for pictures.
double round_limit(const std::vector<Panel>& panels);

/// The sheet as SVG that starts with its <svg> element, a file and a part of an HTML page alike; pictures are inside.
/// Throws OutputError.
std::string panels_svg(const PanelSheet& sheet);

}  // namespace clerestory
