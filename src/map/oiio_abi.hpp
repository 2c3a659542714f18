#pragma once

#include <cstddef>
#include <cstdint>

/// The C interface between the program and the module that holds OpenImageIO. Plain C types only: the two are compiled
/// together, but a C++ exception or type must not cross where one side lacks OpenImageIO.
namespace clerestory::oiio_abi {

constexpr int VERSION = 3;
constexpr std::size_t MESSAGE_SIZE = 1024;
constexpr std::size_t NAME_SIZE = 64;
constexpr int ANY_PART = -1;  ///< the first that is no thumbnail

struct Info {
    std::int64_t x;  ///< of the window that holds texels
    std::int64_t y;
    std::int64_t width;
    std::int64_t height;
    std::int64_t full_x;  ///< of the whole picture
    std::int64_t full_y;
    std::int64_t full_width;
    std::int64_t full_height;
    std::int32_t part;         ///< from 0: a page, an image of a series
    std::int64_t chunk_rows;   ///< rows that must be read together
    std::int32_t has_alpha;    ///< 0 or 1
    std::int32_t is_straight;  ///< 1: colour has not been multiplied by alpha yet
    std::int32_t is_integer;   ///< 0: linear floats; 1: encoded for display, scaled to [0, 1]
    std::int32_t orientation;  ///< as Exif numbers it; 1: the first row is the top one
    double gamma;              ///< of the encoding, where the file says so; else 0 (integers are sRGB then)
    char format[NAME_SIZE];    ///< such as tiff
    char compression[NAME_SIZE];
    char type[NAME_SIZE];         ///< of the stored values, such as uint8
    char channels[4][NAME_SIZE];  ///< red, green, blue, "" each where there is none; a grey file's one alone
};

/// The formats that the module reads, by their own numbers.
enum Format : std::int32_t { FORMAT_TIFF, FORMAT_PNG, FORMAT_JPEG };

struct Image;

/// What the module exports under the name FUNCTIONS. Failures leave one line in `message` [MESSAGE_SIZE].
struct Functions {
    int version;
    /// Null on failure; its message goes on after the file's name.
    Image* (*open)(const char* file, std::int32_t format, int part, Info* info, char* message);
    /// Decodes rows [begin, end) to out [(end - begin) * width * (has_alpha ? 4 : 3)]; grey is given thrice. 0 on
    /// failure.
    int (*read)(Image* image, std::int64_t begin, std::int64_t end, float* out, char* message);
    void (*close)(Image* image);
};

constexpr const char* FUNCTIONS = "clerestory_oiio_functions";

}  // namespace clerestory::oiio_abi
