#include <fmt/format.h>
#include <png.h>

#include <csetjmp>
#include <string>
#include <utility>
#include <vector>

#include "atomic_file.hpp"
#include "error.hpp"
#include "image.hpp"

namespace clerestory {
namespace {

constexpr double DISPLAY_GAMMA = 2.2;  ///< of the preview's tone curve, said in the gAMA chunk as its inverse

/// Runs of equal bytes among the differences to the left neighbour: of 75 settings the quickest that shrinks a sphere's
/// picture, smooth or noisy (5 to 10 ms for 511 x 511). zlib's default takes 4 to 7 times that and saves a quarter of a
/// smooth picture, nothing of a noisy one.
constexpr int ZLIB_LEVEL = 1;
constexpr int ZLIB_STRATEGY = 3;  // Z_RLE
constexpr int FILTERS = PNG_FILTER_SUB;
constexpr std::size_t OUTPUT_BLOCK = std::size_t{1} << 16;  ///< bytes of an IDAT chunk

struct Encoder {
    std::vector<char> bytes;
    std::string message;
};

// libpng is C: nothing may be thrown through it, so its errors come back by longjmp and memory failures are kept.
extern "C" {
static void png_failed(png_structp png, png_const_charp message) {
    static_cast<Encoder*>(png_get_error_ptr(png))->message = message;
    png_longjmp(png, 1);
}
static void png_warned(png_structp, png_const_charp) {}
static void png_append(png_structp png, png_bytep data, png_size_t size) {
    auto& bytes = static_cast<Encoder*>(png_get_io_ptr(png))->bytes;
    bytes.insert(bytes.end(), data, data + size);
}
static void png_flushed(png_structp) {}
}

/// Encodes into `encoder`; false with its message set when libpng refuses. Holds nothing that longjmp would leak.
bool encode(Encoder& encoder, png_structp png, png_infop info, std::size_t width, std::size_t height,
            std::size_t channels, const unsigned char* pixels) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_set_write_fn(png, &encoder, png_append, png_flushed);
    png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8,
                 channels == 4 ? PNG_COLOR_TYPE_RGBA : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_gAMA(png, info, 1.0 / DISPLAY_GAMMA);
    png_set_compression_level(png, ZLIB_LEVEL);
    png_set_compression_strategy(png, ZLIB_STRATEGY);
    png_set_compression_buffer_size(png, OUTPUT_BLOCK);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, FILTERS);
    png_write_info(png, info);
    for (std::size_t y = 0; y < height; ++y) png_write_row(png, pixels + y * width * channels);
    png_write_end(png, info);
    return true;
}

}  // namespace

std::vector<char> png_bytes(const std::filesystem::path& file, std::size_t width, std::size_t height,
                            std::size_t channels, const unsigned char* pixels) {
    if (channels != 3 && channels != 4) {
        throw OutputError(fmt::format("{}: PNG is written with 3 or 4 channels, not {}", file.string(), channels));
    }
    if (width == 0 || height == 0 || width > PNG_UINT_31_MAX || height > PNG_UINT_31_MAX) {
        throw OutputError(fmt::format("{}: PNG cannot hold {} x {} pixels", file.string(), width, height));
    }
    Encoder encoder;
    encoder.bytes.reserve(width * height * channels / 2 + 4096);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &encoder, png_failed, png_warned);
    png_infop info = png ? png_create_info_struct(png) : nullptr;
    const bool encoded = info && encode(encoder, png, info, width, height, channels, pixels);
    png_destroy_write_struct(&png, &info);
    if (!encoded) {
        throw OutputError(fmt::format("{}: PNG encoding failed: {}", file.string(),
                                      encoder.message.empty() ? "out of memory" : encoder.message));
    }
    return std::move(encoder.bytes);
}

void write_png(const std::filesystem::path& file, std::size_t width, std::size_t height, std::size_t channels,
               const unsigned char* pixels) {
    write_bytes(file, png_bytes(file, width, height, channels, pixels));
}

}  // namespace clerestory
