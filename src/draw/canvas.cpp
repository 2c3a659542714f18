#include "draw/canvas.hpp"

#include <fmt/format.h>
#include <png.h>

#include <cmath>

#include "draw/gnuplot.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

std::string hex(Rgb colour) { return fmt::format("#{:02x}{:02x}{:02x}", colour[0], colour[1], colour[2]); }

std::string label_script(const Label& label, std::size_t width, std::size_t height) {
    constexpr std::array<const char*, 3> ALIGNMENTS = {"left", "centre", "right"};
    return fmt::format("set label {} at screen {},{} {} font 'sans{},{}' textcolor rgb '{}' noenhanced\n",
                       plot::quoted(label.text), label.x / static_cast<double>(width),
                       1 - label.y / static_cast<double>(height), ALIGNMENTS[static_cast<std::size_t>(label.align)],
                       label.bold ? ":Bold" : "", label.size, hex(label.ink));
}

std::vector<unsigned char> decoded_png(const std::string& png, std::size_t width, std::size_t height) {
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    std::vector<unsigned char> rgb(3 * width * height);
    bool read = png_image_begin_read_from_memory(&image, png.data(), png.size()) != 0;
    image.format = PNG_FORMAT_RGB;
    read = read && image.width == width && image.height == height &&
           png_image_finish_read(&image, nullptr, rgb.data(), 0, nullptr) != 0;
    const std::string message = image.message;
    png_image_free(&image);
    if (!read) throw OutputError(fmt::format("gnuplot's labels are no {} x {} PNG: {}", width, height, message));
    return rgb;
}

}  // namespace

Canvas::Canvas(std::size_t width, std::size_t height, Rgb ground, const std::vector<Label>& labels)
    : width_(width), height_(height) {
    std::string script = fmt::format(
        "set encoding utf8\nset terminal pngcairo size {},{} background '{}'\n"
        "unset border\nunset tics\nunset key\nset margins 0,0,0,0\n",
        width, height, hex(ground));
    for (const Label& label : labels) script += label_script(label, width, height);
    // gnuplot draws labels only with a plot; this one has nothing within its ranges.
    script += "plot [0:1] [0:1] -1\n";
    rgb_ = decoded_png(plot::run_gnuplot(script).output, width, height);
}

void Canvas::lay(std::span<const unsigned char> rgba, std::size_t width, std::size_t height, std::size_t factor,
                 std::size_t left, std::size_t top) {
    const auto squares = static_cast<double>(factor * factor);
    for (std::size_t y = 0; y < height; ++y) {
        for (std::size_t x = 0; x < width; ++x) {
            double cover = 0;
            std::array<double, 3> sum{};
            for (std::size_t k = 0; k < factor * factor; ++k) {
                const std::size_t row = factor * y + k / factor;
                const std::size_t column = factor * x + k % factor;
                const unsigned char* texel = rgba.data() + 4 * (row * factor * width + column);
                cover += texel[3] / 255.0;
                for (std::size_t c = 0; c < 3; ++c) sum[c] += texel[c] * (texel[3] / 255.0);
            }
            unsigned char* pixel = rgb_.data() + 3 * ((top + y) * width_ + left + x);
            for (std::size_t c = 0; c < 3; ++c) {
                const double value = (sum[c] + (squares - cover) * pixel[c]) / squares;
                pixel[c] = static_cast<unsigned char>(std::lround(value));
            }
        }
    }
}

}  // namespace clerestory
