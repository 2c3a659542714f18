#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

/// Writers of small TIFF, PNG and JPEG files in the ways that other programs store them, by the formats' own libraries.
namespace clerestory::test {

/// How a TIFF file is stored; the numbers are TIFF's own.
struct TiffForm {
    std::string name = {};
    int width = 9;
    int height = 7;
    int samples = 3;
    int bits = 32;
    bool is_float = true;
    std::uint16_t compression = 1;
    int predictor = 1;
    int rows_per_strip = 0;  ///< 0: all in one
    int tile_side = 0;       ///< 0: strips
    bool is_planar = false;
    bool is_palette = false;  ///< its colour i is (i, 255 - i, 7)
    const char* mode = "w";   ///< wb: big-endian, w8: BigTIFF
    int thumbnails = 0;       ///< pages before the picture's
};

/// The values that a file of this form holds: different in each sample, exact in it [height * width * samples].
std::vector<float> tiff_values(const TiffForm& form);
void write_coded_tiff(const std::filesystem::path& file, const TiffForm& form);

/// Forms of every kind that is read without loss.
std::vector<TiffForm> tiff_forms();

struct PngForm {
    std::string name = {};
    int width = 9;
    int height = 7;
    int colour = 2;  ///< PNG's colour type
    int depth = 8;
    bool is_interlaced = false;
    std::vector<unsigned char> bytes = {};  ///< of all rows; else a ramp
};
void write_coded_png(const std::filesystem::path& file, const PngForm& form);
std::vector<PngForm> png_forms();

struct JpegForm {
    std::string name = {};
    int width = 19;
    int height = 13;
    int components = 3;
    bool is_progressive = false;
    int restart_rows = 0;
};
void write_coded_jpeg(const std::filesystem::path& file, const JpegForm& form);
std::vector<JpegForm> jpeg_forms();

}  // namespace clerestory::test
