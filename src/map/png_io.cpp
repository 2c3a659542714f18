#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdint>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/atomic_file.hpp"
#include "error.hpp"
#include "image.hpp"
#include "map/png_text.hpp"

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
            std::size_t channels, const unsigned char* pixels, std::span<png_text> text) {
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
    if (!text.empty()) png_set_text(png, info, text.data(), static_cast<int>(text.size()));
    png_write_info(png, info);
    for (std::size_t y = 0; y < height; ++y) png_write_row(png, pixels + y * width * channels);
    png_write_end(png, info);
    return true;
}

/// As libpng takes them; it reads through its pointers only.
std::vector<png_text> text_chunks(const PngText& text) {
    std::vector<png_text> chunks;
    for (const auto& [key, value] : text) {
        png_text chunk{};
        chunk.compression = PNG_TEXT_COMPRESSION_NONE;
        chunk.key = const_cast<char*>(key.c_str());
        chunk.text = const_cast<char*>(value.c_str());
        chunk.text_length = value.size();
        chunks.push_back(chunk);
    }
    return chunks;
}

constexpr std::size_t SIGNATURE_BYTES = 8;
constexpr std::size_t CHUNK_FRAME = 12;  ///< length, type and checksum about a chunk's data

std::uint32_t big_endian(const unsigned char* at) {
    return std::uint32_t{at[0]} << 24U | std::uint32_t{at[1]} << 16U | std::uint32_t{at[2]} << 8U | at[3];
}

/// Whether a file ends with the chunk that ends a PNG.
bool ends_whole(std::istream& in) {
    std::array<char, CHUNK_FRAME> tail{};
    in.seekg(-static_cast<std::streamoff>(tail.size()), std::ios::end);
    in.read(tail.data(), tail.size());
    return in && std::string_view(tail.data() + 4, 4) == "IEND";
}

}  // namespace

PngText read_png_text(const std::filesystem::path& file) {
    PngText text;
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) return text;
    std::ifstream in(file, std::ios::binary);
    if (!in || !ends_whole(in)) return text;
    const auto length = static_cast<std::uint64_t>(in.tellg());
    for (std::uint64_t at = SIGNATURE_BYTES; at + CHUNK_FRAME <= length;) {
        std::array<unsigned char, 8> head{};
        in.seekg(static_cast<std::streamoff>(at));
        in.read(reinterpret_cast<char*>(head.data()), head.size());
        const std::uint32_t size = big_endian(head.data());
        const std::string_view type(reinterpret_cast<const char*>(head.data()) + 4, 4);
        if (!in || type == "IDAT" || at + CHUNK_FRAME + size > length) break;
        if (type == "tEXt") {
            std::string data(size, '\0');
            in.read(data.data(), static_cast<std::streamsize>(size));
            const std::size_t end = std::min(data.find('\0'), data.size());
            text[data.substr(0, end)] = data.substr(std::min(end + 1, data.size()));
        }
        at += CHUNK_FRAME + size;
    }
    return text;
}

std::vector<char> png_bytes(const std::filesystem::path& file, std::size_t width, std::size_t height,
                            std::size_t channels, const unsigned char* pixels, const PngText& text) {
    if (channels != 3 && channels != 4) {
        throw OutputError(fmt::format("{}: PNG is written with 3 or 4 channels, not {}", file.string(), channels));
    }
    if (width == 0 || height == 0 || width > PNG_UINT_31_MAX || height > PNG_UINT_31_MAX) {
        throw OutputError(fmt::format("{}: PNG cannot hold {} x {} pixels", file.string(), width, height));
    }
    Encoder encoder;
    std::vector<png_text> chunks = text_chunks(text);
    encoder.bytes.reserve(width * height * channels / 2 + 4096);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &encoder, png_failed, png_warned);
    png_infop info = png ? png_create_info_struct(png) : nullptr;
    const bool encoded = info && encode(encoder, png, info, width, height, channels, pixels, chunks);
    png_destroy_write_struct(&png, &info);
    if (!encoded) {
        throw OutputError(fmt::format("{}: PNG encoding failed: {}", file.string(),
                                      encoder.message.empty() ? "out of memory" : encoder.message));
    }
    return std::move(encoder.bytes);
}

void write_png(const std::filesystem::path& file, std::size_t width, std::size_t height, std::size_t channels,
               const unsigned char* pixels, const PngText& text) {
    write_bytes(file, png_bytes(file, width, height, channels, pixels, text));
}

void write_png(const std::filesystem::path& file, std::size_t width, std::size_t height, std::size_t channels,
               const unsigned char* pixels) {
    write_png(file, width, height, channels, pixels, {});
}

}  // namespace clerestory
