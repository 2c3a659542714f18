#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace clerestory {

/// How values become colours. Both maps hold for readers with any common colour blindness, and their middle or end is
/// pale on light and dark ground alike.
enum class ColourMap {
    diverging,   ///< blue below 0, orange above
    sequential,  ///< pale at 0, purple at the limit
};

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

/// A round limit (1, 2 or 5 times a power of ten) that only 1 of 200 values is above.
double round_limit(const std::vector<Panel>& panels);

/// The sheet as SVG that starts with its <svg> element, a file and a part of an HTML page alike; pictures are inside.
/// Throws OutputError.
std::string panels_svg(const PanelSheet& sheet);

}  // namespace clerestory
