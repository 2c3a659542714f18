#pragma once

#include <ImfCompression.h>
#include <ImfHeader.h>
#include <ImfPixelType.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

/// Writers of small image files of every kind, independent of the program's own.
namespace clerestory::test {

/// One channel of an EXR file: `values` [height * width], top row first.
struct ExrChannel {
    std::string name;
    Imf::PixelType type = Imf::FLOAT;
    std::vector<float> values;
    int sampling = 1;
};

struct ExrLayout {
    int width = 0;
    int height = 0;
    int origin_x = 0;  ///< of the data window
    int origin_y = 0;
    int tile_side = 0;  ///< 0: scanlines
    bool mip_levels = false;
    Imf::Compression compression = Imf::ZIP_COMPRESSION;
    std::function<void(Imf::Header&)> edit = {};  ///< what else its header says
};

void write_test_exr(const std::filesystem::path& file, const ExrLayout& layout,
                    const std::vector<ExrChannel>& channels);

/// A file of two parts: deep samples first, then `channels`.
void write_deep_then_flat(const std::filesystem::path& file, const ExrLayout& layout,
                          const std::vector<ExrChannel>& channels);

/// One part of a file of several.
struct ExrTestPart {
    std::string name;
    std::vector<ExrChannel> channels;
};
void write_exr_parts(const std::filesystem::path& file, const ExrLayout& layout, const std::vector<ExrTestPart>& parts);

/// `rgb` [3 * height * width] as luminance and chroma at half the resolution, in half floats.
void write_chroma_exr(const std::filesystem::path& file, int width, int height, const std::vector<float>& rgb);

/// `rgb` [3 * height * width], top row first; PFM itself stores the bottom row first.
void write_pfm(const std::filesystem::path& file, int width, int height, const std::vector<float>& rgb);
/// Grey PFM of `grey` [height * width], top row first.
void write_grey_pfm(const std::filesystem::path& file, int width, int height, const std::vector<float>& grey);

/// Radiance RGBE without run lengths; every value must be one that RGBE holds.
void write_rgbe(const std::filesystem::path& file, int width, int height, const std::vector<float>& rgb);

/// A TIFF tag with one whole number.
struct TiffTag {
    std::uint16_t number = 0;
    std::uint32_t value = 0;
};

/// Uncompressed little-endian float TIFF of `channels` interleaved channels.
///   more  tags beside those that it must have, or in their place
void write_float_tiff(const std::filesystem::path& file, int width, int height, int channels,
                      const std::vector<float>& values, const std::vector<TiffTag>& more = {});

/// The same in square tiles, of which there are several; `tile_side` is a multiple of 16.
void write_tiled_float_tiff(const std::filesystem::path& file, int width, int height, int channels, int tile_side,
                            const std::vector<float>& values);

/// A picture whose every value differs and is exact in half, float and (`scale` a power of two) RGBE's shared exponent.
std::vector<float> ramp(std::size_t count, float scale = 1.0F / 64);

/// Channel `c` of interleaved `rgb` with `channels` channels.
std::vector<float> channel(const std::vector<float>& rgb, std::size_t c, std::size_t channels = 3);

void write_raw(const std::filesystem::path& file, const std::string& bytes);

}  // namespace clerestory::test
