#include "coded_files.hpp"

// jpeglib.h wants this before it.
#include <cstdio>

#include <half.h>
#include <jpeglib.h>
#include <png.h>
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;

/// Sample `i` of a file: a ramp that repeats after a prime, so that neither rows nor channels are alike.
int code_of(std::size_t i, int bits) { return static_cast<int>(1 + i % 251) % (1 << std::min(bits, 8)); }

/// `value` as the form stores it.
void append_sample(std::vector<unsigned char>& row, const TiffForm& form, int code) {
    const auto append = [&](auto value) {
        const auto* bytes = reinterpret_cast<const unsigned char*>(&value);
        row.insert(row.end(), bytes, bytes + sizeof value);
    };
    if (form.is_float && form.bits == 16) append(half(static_cast<float>(code)));
    if (form.is_float && form.bits == 32) append(static_cast<float>(code));
    if (form.is_float && form.bits == 64) append(static_cast<double>(code));
    if (!form.is_float && form.bits == 8) append(static_cast<std::uint8_t>(code));
    if (!form.is_float && form.bits == 16) append(static_cast<std::uint16_t>(code * 257));
    if (!form.is_float && form.bits == 32) append(static_cast<std::uint32_t>(code) * 16843009U);
}

/// One block: samples of the texels from (left, top), whose codes outside the picture are 0.
std::vector<unsigned char> tiff_block(const TiffForm& form, int left, int top, int width, int height, int plane) {
    std::vector<unsigned char> bytes;
    for (int y = top; y < top + height; ++y) {
        for (int x = left; x < left + width; ++x) {
            for (int c = 0; c < (form.is_planar ? 1 : form.samples); ++c) {
                const int sample = form.is_planar ? plane : c;
                const bool inside = x < form.width && y < form.height;
                const int at = (y * form.width + x) * form.samples + sample;
                append_sample(bytes, form, inside ? code_of(static_cast<std::size_t>(at), form.bits) : 0);
            }
        }
    }
    return bytes;
}

void set_tags(TIFF* tiff, const TiffForm& form, bool is_thumbnail) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, form.width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, form.height);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, form.samples);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, form.bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, form.is_float ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, form.compression);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, form.is_planar ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, form.samples < 3 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
    if (form.is_palette) {
        std::array<std::vector<std::uint16_t>, 3> colours;
        for (int i = 0; i < 256; ++i) {
            colours[0].push_back(static_cast<std::uint16_t>(257 * i));
            colours[1].push_back(static_cast<std::uint16_t>(257 * (255 - i)));
            colours[2].push_back(257 * 7);
        }
        TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_PALETTE);
        TIFFSetField(tiff, TIFFTAG_COLORMAP, colours[0].data(), colours[1].data(), colours[2].data());
    }
    if (form.predictor != 1) TIFFSetField(tiff, TIFFTAG_PREDICTOR, form.predictor);
    if (is_thumbnail) TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, FILETYPE_REDUCEDIMAGE);
    const std::uint16_t alpha = EXTRASAMPLE_ASSOCALPHA;
    if (form.samples % 2 == 0) TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &alpha);
    if (form.tile_side > 0) {
        TIFFSetField(tiff, TIFFTAG_TILEWIDTH, form.tile_side);
        TIFFSetField(tiff, TIFFTAG_TILELENGTH, form.tile_side);
    } else {
        TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, form.rows_per_strip > 0 ? form.rows_per_strip : form.height);
    }
}

bool write_page(TIFF* tiff, const TiffForm& form, bool is_thumbnail) {
    set_tags(tiff, form, is_thumbnail);
    const bool tiled = form.tile_side > 0;
    const int block_width = tiled ? form.tile_side : form.width;
    const int block_height = tiled ? form.tile_side : form.rows_per_strip > 0 ? form.rows_per_strip : form.height;
    std::uint32_t block = 0;
    for (int plane = 0; plane < (form.is_planar ? form.samples : 1); ++plane) {
        for (int top = 0; top < form.height; top += block_height) {
            for (int left = 0; left < form.width; left += block_width) {
                const int rows = tiled ? block_height : std::min(block_height, form.height - top);
                std::vector<unsigned char> bytes = tiff_block(form, left, top, block_width, rows, plane);
                const auto size = static_cast<tmsize_t>(bytes.size());
                const tmsize_t written = tiled ? TIFFWriteEncodedTile(tiff, block, bytes.data(), size)
                                               : TIFFWriteEncodedStrip(tiff, block, bytes.data(), size);
                if (written != size) return false;
                ++block;
            }
        }
    }
    return TIFFWriteDirectory(tiff) == 1;
}

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

File created(const fs::path& file) {
    File out(std::fopen(file.c_str(), "wb"));
    if (!out) throw std::runtime_error("cannot write " + file.string());
    return out;
}

}  // namespace

std::vector<float> tiff_values(const TiffForm& form) {
    std::vector<float> values;
    for (int i = 0; i < form.width * form.height * form.samples; ++i) {
        const auto code = static_cast<float>(code_of(static_cast<std::size_t>(i), form.bits));
        values.push_back(form.is_float ? code : code / 255);
    }
    return values;
}

void write_coded_tiff(const fs::path& file, const TiffForm& form) {
    TIFFSetWarningHandler(nullptr);  // it would be said that one of Deflate's two numbers is the older one
    const std::unique_ptr<TIFF, decltype(&TIFFClose)> tiff(TIFFOpen(file.c_str(), form.mode), TIFFClose);
    bool written = tiff != nullptr;
    TiffForm small = form;
    small.width = small.height = 2;
    for (int i = 0; written && i < form.thumbnails; ++i) written = write_page(tiff.get(), small, true);
    if (!written || !write_page(tiff.get(), form, false)) throw std::runtime_error("cannot write " + file.string());
}

std::vector<TiffForm> tiff_forms() {
    return {
        {.name = "one_texel", .width = 1, .height = 1},
        {.name = "two_wide", .width = 2, .height = 1, .compression = COMPRESSION_ADOBE_DEFLATE},
        {.name = "one_strip"},
        {.name = "strips", .rows_per_strip = 3},
        {.name = "tiles", .width = 37, .height = 21, .tile_side = 16},
        {.name = "planes", .rows_per_strip = 3, .is_planar = true},
        {.name = "planes_in_tiles", .width = 37, .height = 21, .tile_side = 16, .is_planar = true},
        {.name = "big_tiff", .rows_per_strip = 2, .mode = "w8"},
        {.name = "big_endian", .rows_per_strip = 2, .mode = "wb"},
        {.name = "big_endian_16", .bits = 16, .is_float = false, .compression = COMPRESSION_LZW, .mode = "wb"},
        {.name = "big_endian_double", .bits = 64, .mode = "wb"},
        {.name = "half", .bits = 16, .compression = COMPRESSION_ADOBE_DEFLATE},
        {.name = "double", .bits = 64, .rows_per_strip = 2},
        {.name = "uint8_lzw", .bits = 8, .is_float = false, .compression = COMPRESSION_LZW, .rows_per_strip = 2},
        {.name = "uint8_zip", .bits = 8, .is_float = false, .compression = COMPRESSION_ADOBE_DEFLATE, .predictor = 2},
        {.name = "uint8_zip_strips",
         .bits = 8,
         .is_float = false,
         .compression = COMPRESSION_DEFLATE,
         .rows_per_strip = 2},
        {.name = "uint8_packbits", .bits = 8, .is_float = false, .compression = COMPRESSION_PACKBITS},
        {.name = "uint16_zip_tiles",
         .width = 37,
         .height = 21,
         .bits = 16,
         .is_float = false,
         .compression = COMPRESSION_ADOBE_DEFLATE,
         .predictor = 2,
         .tile_side = 16},
        {.name = "uint32", .bits = 32, .is_float = false},
        {.name = "float_predictor", .compression = COMPRESSION_ADOBE_DEFLATE, .predictor = 3, .rows_per_strip = 4},
        {.name = "float_lzw", .compression = COMPRESSION_LZW},
        {.name = "zstd", .compression = COMPRESSION_ZSTD, .rows_per_strip = 4},
        {.name = "lzma", .compression = COMPRESSION_LZMA},
        {.name = "grey", .samples = 1, .rows_per_strip = 2},
        {.name = "grey_alpha", .samples = 2},
        {.name = "rgba", .samples = 4, .rows_per_strip = 4},
        {.name = "thumbnail_first", .rows_per_strip = 3, .thumbnails = 2}};
}

void write_coded_png(const fs::path& file, const PngForm& form) {
    const File out = created(file);
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
    png_infop info = png_create_info_struct(png);
    png_init_io(png, out.get());
    const auto width = static_cast<png_uint_32>(form.width);
    const auto height = static_cast<png_uint_32>(form.height);
    png_set_IHDR(png, info, width, height, form.depth, form.colour,
                 form.is_interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
                 PNG_FILTER_TYPE_DEFAULT);
    std::vector<png_color> palette;
    for (int i = 0; i < 1 << std::min(form.depth, 8); ++i) {
        const auto level = static_cast<png_byte>(17 * i);
        palette.push_back({level, static_cast<png_byte>(255 - level), 7});
    }
    if (form.colour == PNG_COLOR_TYPE_PALETTE) {
        png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
    }
    png_write_info(png, info);
    const std::size_t row_bytes = png_get_rowbytes(png, info);
    std::vector<unsigned char> bytes = form.bytes;
    for (std::size_t i = bytes.size(); i < row_bytes * height; ++i) {
        bytes.push_back(static_cast<unsigned char>(1 + i % 251));
    }
    std::vector<png_bytep> rows;
    for (std::size_t y = 0; y < height; ++y) rows.push_back(bytes.data() + y * row_bytes);
    png_write_image(png, rows.data());
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
}

std::vector<PngForm> png_forms() {
    return {{.name = "one_texel", .width = 1, .height = 1},
            {.name = "two_wide", .width = 2, .height = 1},
            {.name = "rgb"},
            {.name = "rgb16", .depth = 16},
            {.name = "rgba", .colour = 6},
            {.name = "grey", .colour = 0},
            {.name = "grey_alpha16", .colour = 4, .depth = 16},
            {.name = "one_bit", .colour = 0, .depth = 1},
            {.name = "palette", .colour = 3, .depth = 4},
            {.name = "interlaced", .is_interlaced = true},
            {.name = "interlaced16", .width = 2, .height = 1, .depth = 16, .is_interlaced = true}};
}

void write_coded_jpeg(const fs::path& file, const JpegForm& form) {
    const File out = created(file);
    jpeg_compress_struct jpeg{};
    jpeg_error_mgr errors{};
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    jpeg_stdio_dest(&jpeg, out.get());
    jpeg.image_width = static_cast<JDIMENSION>(form.width);
    jpeg.image_height = static_cast<JDIMENSION>(form.height);
    jpeg.input_components = form.components;
    jpeg.in_color_space = form.components == 1 ? JCS_GRAYSCALE : form.components == 3 ? JCS_RGB : JCS_CMYK;
    jpeg_set_defaults(&jpeg);
    if (form.is_progressive) jpeg_simple_progression(&jpeg);
    jpeg.restart_in_rows = form.restart_rows;
    jpeg_start_compress(&jpeg, TRUE);
    std::vector<unsigned char> row(static_cast<std::size_t>(form.width * form.components));
    for (int y = 0; y < form.height; ++y) {
        for (std::size_t i = 0; i < row.size(); ++i) {
            row[i] = static_cast<unsigned char>(128 + 100 * std::sin(0.7 * static_cast<double>(i) + y));
        }
        JSAMPROW pointer = row.data();
        jpeg_write_scanlines(&jpeg, &pointer, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
}

std::vector<JpegForm> jpeg_forms() {
    return {{.name = "one_texel", .width = 1, .height = 1},
            {.name = "two_wide", .width = 2, .height = 1},
            {.name = "rgb"},
            {.name = "grey", .components = 1},
            {.name = "progressive", .width = 40, .height = 21, .is_progressive = true},
            {.name = "restarts", .width = 40, .height = 37, .restart_rows = 1}};
}

}  // namespace clerestory::test
