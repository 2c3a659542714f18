#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clerestory/export.hpp"

namespace clerestory {

/// Floats on a page boundary, so that a CPU device can use them where they lie. Not zeroed. Movable.
class CLERESTORY_API PageBuffer {
  public:
    PageBuffer() = default;
    explicit PageBuffer(std::size_t count);
    [[nodiscard]] float* data() noexcept { return data_.get(); }
    [[nodiscard]] const float* data() const noexcept { return data_.get(); }
    [[nodiscard]] std::size_t size() const noexcept { return count_; }
    float& operator[](std::size_t i) { return data_.get()[i]; }
    const float& operator[](std::size_t i) const { return data_.get()[i]; }

  private:
    struct Free {
        void operator()(float* p) const noexcept;
    };
    std::unique_ptr<float, Free> data_;
    std::size_t count_ = 0;
};

/// Something about a map that its user should know, with a name that stays.
struct MapNote {
    std::string id;    ///< such as cropped, eight_bit, other_primaries, not_2_to_1
    std::string text;  ///< what goes on after the file's name; says what was done, and which flag changes it
};

/// What of an image file was read.
struct MapSource {
    std::string format;                 ///< OpenEXR, Radiance, PFM, or OpenImageIO's name, such as tiff
    std::string compression;            ///< as the format names it; none
    std::string type;                   ///< of the stored values: half, float, uint, rgbe, uint8, ...
    int part = 0;                       ///< of the file, from 0
    std::string layer;                  ///< whose channels lit; empty for the unnamed one
    std::vector<std::string> channels;  ///< red, green and blue; a lone grey one; luminance and two of chroma
    std::vector<MapNote> notes;
    bool plain = false;  ///< other programs read the same from the file: its only layer, nothing cropped or converted
};

/// An RGB radiance map in memory.
///   rgb [3 * height * width]  linear, interleaved, row-major, top row first
struct RadianceMap {
    std::size_t width = 0;
    std::size_t height = 0;
    PageBuffer rgb;
    std::size_t ringing = 0;  ///< negative values that lossy compression (DWA) had left, read as 0
    MapSource source = {};
};

/// An image with or without alpha, as `compare` reads it.
///   rgb   [3 * height * width]  linear, interleaved, row-major, top row first
///   alpha [height * width]      empty where the file has none
struct Picture {
    std::size_t width = 0;
    std::size_t height = 0;
    std::vector<float> rgb;
    std::vector<float> alpha;
    MapSource source = {};
};

/// Limits on a file's claimed size, checked before any memory is taken.
struct ReadLimits {
    std::size_t max_side = std::size_t{1} << 20;
    std::size_t max_texels = std::size_t{1} << 28;
    std::size_t max_bytes = 0;  ///< memory that the decoded map may take; 0: what the machine has available
};

/// How to read a map.
struct ReadOptions {
    bool flip_y = false;           ///< the file's rows are stored bottom-up
    std::string layer = {};        ///< of an EXR file, by its whole name or its last words; empty: the picture's
    std::optional<int> part = {};  ///< of the file, from 0; without: the first that holds the picture
    ReadLimits limits;
    std::filesystem::path
        oiio_module;  ///< absolute path of the module that reads what is not EXR; empty: where the program has it
    /// Called after rows [begin, end) of the map have their final values, in any order and from any thread but never
    /// two at a time; lets work on the map overlap its decoding.
    std::function<void(const RadianceMap& map, std::size_t begin, std::size_t end)> rows_ready;
};

/// Reads a latitude-longitude map: the layer that is the picture, or the one that the options name; never depth,
/// normals, mattes, thumbnails or alpha. What the file holds of it stands at its place in the whole picture (EXR's
/// display window), and the rest is black. Floats are taken as linear; integers as sRGB, or as encoded with the gamma
/// that the file names. Negative values of a file whose compression rings (DWA) are its error, not radiance, and become
/// 0; all other bad values are left as they are. Throws InputError; cube maps are refused.
CLERESTORY_API RadianceMap read_map(const std::filesystem::path& file, const ReadOptions& options = {});

/// Reads any image with its alpha, colour multiplied by it and linear as in read_map; no value is repaired. Throws
/// InputError.
CLERESTORY_API Picture read_picture(const std::filesystem::path& file, const ReadOptions& options = {});

/// One header attribute of an EXR file: text, or a number.
struct HeaderValue {
    std::string text;
    double number = 0;
    bool is_number = false;
};
using Header = std::map<std::string, HeaderValue>;

/// Writes float RGBA (`rgba` [4 * height * width], top row first) with `header` as attributes; whole or not at all.
/// Throws OutputError.
CLERESTORY_API void write_exr(const std::filesystem::path& file, std::size_t width, std::size_t height,
                              const float* rgba, const Header& header);

/// The same with channels of any names, 32-bit floats.
///   pixels [channels * height * width]  interleaved in the order of `channels`
CLERESTORY_API void write_exr_channels(const std::filesystem::path& file, std::size_t width, std::size_t height,
                                       const std::vector<std::string>& channels, const float* pixels,
                                       const Header& header);

/// The attributes of an EXR file that write_exr can write (text and numbers). Throws InputError.
CLERESTORY_API Header read_exr_header(const std::filesystem::path& file);

/// Writes 8-bit PNG of `channels` 3 or 4, sRGB-tagged by gamma only; whole or not at all. Throws OutputError.
///   pixels [channels * height * width]  interleaved, top row first
CLERESTORY_API void write_png(const std::filesystem::path& file, std::size_t width, std::size_t height,
                              std::size_t channels, const unsigned char* pixels);

}  // namespace clerestory
