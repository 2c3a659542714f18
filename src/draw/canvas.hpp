#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace clerestory {

/// 8-bit red, green and blue.
using Rgb = std::array<unsigned char, 3>;

enum class Align { left, centre, right };

/// A line of text on a canvas.
struct Label {
    double x = 0;  ///< pixels from the left edge
    double y = 0;  ///< pixels from the top edge to the middle of the line
    std::string text;
    double size = 12;  ///< of the font, points
    Align align = Align::left;
    bool bold = false;
    Rgb ink = {};
};

/// An 8-bit picture with text on an even ground, on which other pictures are laid pixel by pixel.
class Canvas {
  public:
    /// gnuplot writes the labels. Throws OutputError.
    Canvas(std::size_t width, std::size_t height, Rgb ground, const std::vector<Label>& labels);

    [[nodiscard]] std::size_t width() const noexcept { return width_; }
    [[nodiscard]] std::size_t height() const noexcept { return height_; }
    /// [3 * height * width]
    [[nodiscard]] const std::vector<unsigned char>& rgb() const noexcept { return rgb_; }

    /// Lays a picture with its upper left corner at (left, top), which must fit; what is transparent shows the ground.
    ///   rgba  [4 * height * width * factor^2]  squares of factor x factor become one pixel, their mean
    void lay(std::span<const unsigned char> rgba, std::size_t width, std::size_t height, std::size_t factor,
             std::size_t left, std::size_t top);

  private:
    std::size_t width_;
    std::size_t height_;
    std::vector<unsigned char> rgb_;
};

}  // namespace clerestory
