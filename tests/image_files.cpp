#include "image_files.hpp"

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputPart.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfRgbaFile.h>
#include <ImfTiledOutputFile.h>
#include <half.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <stdexcept>

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;

Imf::Header header_of(const ExrLayout& layout, const std::vector<ExrChannel>& channels) {
    const Imath::Box2i window({layout.origin_x, layout.origin_y},
                              {layout.origin_x + layout.width - 1, layout.origin_y + layout.height - 1});
    Imf::Header header(window, window);
    header.compression() = layout.compression;
    for (const ExrChannel& c : channels) {
        header.channels().insert(c.name, Imf::Channel(c.type, c.sampling, c.sampling));
    }
    if (layout.edit) layout.edit(header);
    return header;
}

/// The values in the type of their channel, and slices over them.
class Storage {
  public:
    Storage(const ExrLayout& layout, const std::vector<ExrChannel>& channels) {
        for (const ExrChannel& c : channels) {
            const std::size_t size = c.type == Imf::HALF ? 2 : 4;
            std::vector<char> bytes(size * c.values.size());
            for (std::size_t i = 0; i < c.values.size(); ++i) {
                if (c.type == Imf::HALF) reinterpret_cast<half*>(bytes.data())[i] = half(c.values[i]);
                if (c.type == Imf::FLOAT) reinterpret_cast<float*>(bytes.data())[i] = c.values[i];
                if (c.type == Imf::UINT) {
                    reinterpret_cast<std::uint32_t*>(bytes.data())[i] = static_cast<std::uint32_t>(c.values[i]);
                }
            }
            columns_.push_back(std::move(bytes));
            const Imath::V2i origin(layout.origin_x, layout.origin_y);
            frame_.insert(c.name, Imf::Slice::Make(c.type, columns_.back().data(), origin, std::int64_t{layout.width},
                                                   std::int64_t{layout.height}, std::size_t{0}, std::size_t{0},
                                                   c.sampling, c.sampling));
        }
    }
    [[nodiscard]] const Imf::FrameBuffer& frame() const { return frame_; }

  private:
    std::vector<std::vector<char>> columns_;
    Imf::FrameBuffer frame_;
};

void append(std::string& bytes, const void* data, std::size_t size) {
    bytes.append(static_cast<const char*>(data), size);
}

std::string pfm_header(const char* kind, int width, int height) {
    return std::string(kind) + "\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1.0\n";
}

void write_pfm_rows(const fs::path& file, std::string bytes, int height, const std::vector<float>& values) {
    const std::size_t row = values.size() / static_cast<std::size_t>(height);
    for (std::size_t y = static_cast<std::size_t>(height); y-- > 0;) {
        append(bytes, values.data() + y * row, row * sizeof(float));
    }
    write_raw(file, bytes);
}

struct TiffEntry {
    std::uint16_t tag, type;
    std::uint32_t count, value;
};
constexpr std::uint16_t TIFF_SHORT = 3, TIFF_LONG = 4;

/// What every float TIFF says; the place of the values is left to `place`, whose tags follow 284 or come before.
std::vector<TiffEntry> tiff_entries(std::uint32_t w, std::uint32_t h, std::uint32_t n,
                                    const std::vector<TiffEntry>& place) {
    std::vector<TiffEntry> entries = {{256, TIFF_LONG, 1, w},
                                      {257, TIFF_LONG, 1, h},
                                      {258, TIFF_SHORT, n, 0},
                                      {259, TIFF_SHORT, 1, 1},
                                      {262, TIFF_SHORT, 1, n >= 3 ? 2U : 1U},
                                      {277, TIFF_SHORT, 1, n},
                                      {284, TIFF_SHORT, 1, 1},
                                      {339, TIFF_SHORT, n, 0}};
    if (n > 3) entries.push_back({338, TIFF_SHORT, 1, 1});
    entries.insert(entries.end(), place.begin(), place.end());
    std::sort(entries.begin(), entries.end(), [](const TiffEntry& a, const TiffEntry& b) { return a.tag < b.tag; });
    return entries;
}

/// Writes `blocks`, strips or tiles of equal size, whose places and sizes the entries `offsets` and `sizes` name.
void write_tiff(const fs::path& file, std::vector<TiffEntry> entries, std::uint16_t offsets, std::uint16_t sizes,
                const std::vector<std::vector<float>>& blocks) {
    constexpr std::uint32_t HEADER = 8, ENTRY = 12;
    const auto after = static_cast<std::uint32_t>(HEADER + 2 + ENTRY * entries.size() + 4);
    const auto block_bytes = static_cast<std::uint32_t>(blocks[0].size() * sizeof(float));
    const auto channels =
        std::find_if(entries.begin(), entries.end(), [](const TiffEntry& e) { return e.tag == 277; })->value;
    const auto count = static_cast<std::uint32_t>(blocks.size());
    // Arrays lie after the directory: bits (32 each unless they are given) and sample formats (3, float) of the
    // channels, places and sizes of the blocks. What fits into four bytes stands in the entry itself.
    const std::uint32_t data = after + 2 * 2 * channels + (count > 1 ? 2 * 4 * count : 0);
    std::string tail;
    for (TiffEntry& e : entries) {
        if (e.tag == 258 || e.tag == 339) {
            const auto usual = e.tag == 258 ? std::uint32_t{32} : std::uint32_t{3};
            const auto each = static_cast<std::uint16_t>(e.value != 0 ? e.value : usual);
            e.value = after + static_cast<std::uint32_t>(tail.size());
            if (channels <= 2) e.value = channels == 1 ? each : each * 0x10001U;
            for (std::uint32_t c = 0; c < channels; ++c) append(tail, &each, 2);
        } else if (e.tag == offsets || e.tag == sizes) {
            e.count = count;
            e.value = count > 1          ? after + static_cast<std::uint32_t>(tail.size())
                      : e.tag == offsets ? data
                                         : block_bytes;
            for (std::uint32_t b = 0; count > 1 && b < count; ++b) {
                const std::uint32_t value = e.tag == offsets ? data + b * block_bytes : block_bytes;
                append(tail, &value, 4);
            }
        }
    }
    std::string bytes("II*\0\x08\0\0\0", HEADER);
    const auto entry_count = static_cast<std::uint16_t>(entries.size());
    append(bytes, &entry_count, 2);
    for (const TiffEntry& e : entries) {
        append(bytes, &e.tag, 2);
        append(bytes, &e.type, 2);
        append(bytes, &e.count, 4);
        append(bytes, &e.value, 4);
    }
    bytes += std::string(4, '\0') + tail;
    for (const auto& block : blocks) append(bytes, block.data(), block.size() * sizeof(float));
    write_raw(file, bytes);
}

}  // namespace

void write_raw(const fs::path& file, const std::string& bytes) {
    std::ofstream out(file, std::ios::binary);
    if (!out.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush()) {
        throw std::runtime_error("cannot write " + file.string());
    }
}

std::vector<float> ramp(std::size_t count, float scale) {
    std::vector<float> values(count);
    for (std::size_t i = 0; i < count; ++i) values[i] = scale * static_cast<float>(1 + i % 2039);
    return values;
}

std::vector<float> channel(const std::vector<float>& rgb, std::size_t c, std::size_t channels) {
    std::vector<float> values;
    for (std::size_t i = c; i < rgb.size(); i += channels) values.push_back(rgb[i]);
    return values;
}

void write_test_exr(const fs::path& file, const ExrLayout& layout, const std::vector<ExrChannel>& channels) {
    const Storage storage(layout, channels);
    Imf::Header header = header_of(layout, channels);
    if (layout.tile_side == 0) {
        Imf::OutputFile out(file.c_str(), header, 0);
        out.setFrameBuffer(storage.frame());
        out.writePixels(layout.height);
        return;
    }
    const auto side = static_cast<unsigned>(layout.tile_side);
    header.setTileDescription(
        Imf::TileDescription(side, side, layout.mip_levels ? Imf::MIPMAP_LEVELS : Imf::ONE_LEVEL));
    Imf::TiledOutputFile out(file.c_str(), header, 0);
    out.setFrameBuffer(storage.frame());
    for (int level = 0; level < out.numLevels(); ++level) {
        out.writeTiles(0, out.numXTiles(level) - 1, 0, out.numYTiles(level) - 1, level);
    }
}

void write_deep_then_flat(const fs::path& file, const ExrLayout& layout, const std::vector<ExrChannel>& channels) {
    Imf::Header deep(layout.width, layout.height);
    deep.setName("deep");
    deep.setType(Imf::DEEPSCANLINE);
    deep.compression() = Imf::ZIPS_COMPRESSION;
    deep.channels().insert("Z", Imf::Channel(Imf::FLOAT));
    Imf::Header flat = header_of(layout, channels);
    flat.setName("flat");
    flat.setType(Imf::SCANLINEIMAGE);
    const Imf::Header headers[] = {deep, flat};
    Imf::MultiPartOutputFile out(file.c_str(), headers, 2, false, 0);

    const auto width = static_cast<std::size_t>(layout.width);
    std::vector<unsigned> counts(width * static_cast<std::size_t>(layout.height), 0);
    std::vector<float*> samples(counts.size(), nullptr);
    Imf::DeepFrameBuffer deep_frame;
    deep_frame.insertSampleCountSlice(
        Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()), sizeof(unsigned), width * sizeof(unsigned)));
    deep_frame.insert("Z", Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(samples.data()), sizeof(float*),
                                          width * sizeof(float*), sizeof(float)));
    Imf::DeepScanLineOutputPart deep_part(out, 0);
    deep_part.setFrameBuffer(deep_frame);
    deep_part.writePixels(layout.height);

    const Storage storage(layout, channels);
    Imf::OutputPart flat_part(out, 1);
    flat_part.setFrameBuffer(storage.frame());
    flat_part.writePixels(layout.height);
}

void write_exr_parts(const fs::path& file, const ExrLayout& layout, const std::vector<ExrTestPart>& parts) {
    std::vector<Imf::Header> headers;
    for (const ExrTestPart& part : parts) {
        headers.push_back(header_of(layout, part.channels));
        headers.back().setName(part.name);
        headers.back().setType(Imf::SCANLINEIMAGE);
    }
    Imf::MultiPartOutputFile out(file.c_str(), headers.data(), static_cast<int>(headers.size()), false, 0);
    for (std::size_t p = 0; p < parts.size(); ++p) {
        const Storage storage(layout, parts[p].channels);
        Imf::OutputPart part(out, static_cast<int>(p));
        part.setFrameBuffer(storage.frame());
        part.writePixels(layout.height);
    }
}

void write_chroma_exr(const fs::path& file, int width, int height, const std::vector<float>& rgb) {
    std::vector<Imf::Rgba> pixels;
    for (std::size_t i = 0; i < rgb.size(); i += 3) pixels.emplace_back(rgb[i], rgb[i + 1], rgb[i + 2], 1.0F);
    Imf::RgbaOutputFile out(file.c_str(), width, height, Imf::WRITE_YC);
    out.setFrameBuffer(pixels.data(), 1, static_cast<std::size_t>(width));
    out.writePixels(height);
}

void write_pfm(const fs::path& file, int width, int height, const std::vector<float>& rgb) {
    write_pfm_rows(file, pfm_header("PF", width, height), height, rgb);
}

void write_grey_pfm(const fs::path& file, int width, int height, const std::vector<float>& grey) {
    write_pfm_rows(file, pfm_header("Pf", width, height), height, grey);
}

void write_rgbe(const fs::path& file, int width, int height, const std::vector<float>& rgb) {
    std::string bytes =
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(height) + " +X " + std::to_string(width) + "\n";
    for (std::size_t t = 0; t < rgb.size(); t += 3) {
        int exponent = 0;
        std::frexp(std::fmax(rgb[t], std::fmax(rgb[t + 1], rgb[t + 2])), &exponent);
        for (std::size_t c = 0; c < 3; ++c)
            bytes += static_cast<char>(std::lround(std::ldexp(rgb[t + c], 8 - exponent)));
        bytes += static_cast<char>(exponent + 128);
    }
    write_raw(file, bytes);
}

void write_float_tiff(const fs::path& file, int width, int height, int channels, const std::vector<float>& values,
                      const std::vector<TiffTag>& more) {
    const auto h = static_cast<std::uint32_t>(height);
    const auto n = static_cast<std::uint32_t>(channels);
    auto entries = tiff_entries(static_cast<std::uint32_t>(width), h, n,
                                {{273, TIFF_LONG, 1, 0}, {278, TIFF_LONG, 1, h}, {279, TIFF_LONG, 1, 0}});
    for (const TiffTag& tag : more) {
        const auto known =
            std::find_if(entries.begin(), entries.end(), [&](const TiffEntry& e) { return e.tag == tag.number; });
        if (known != entries.end()) {
            known->value = tag.value;
        } else {
            entries.push_back({tag.number, TIFF_LONG, 1, tag.value});
        }
    }
    std::sort(entries.begin(), entries.end(), [](const TiffEntry& a, const TiffEntry& b) { return a.tag < b.tag; });
    write_tiff(file, entries, 273, 279, {values});
}

void write_tiled_float_tiff(const fs::path& file, int width, int height, int channels, int tile_side,
                            const std::vector<float>& values) {
    const auto w = static_cast<std::size_t>(width);
    const auto h = static_cast<std::size_t>(height);
    const auto n = static_cast<std::size_t>(channels);
    const auto side = static_cast<std::size_t>(tile_side);
    std::vector<std::vector<float>> tiles;
    for (std::size_t top = 0; top < h; top += side) {
        for (std::size_t left = 0; left < w; left += side) {
            std::vector<float>& tile = tiles.emplace_back(side * side * n, -1.0F);
            for (std::size_t y = top; y < std::min(top + side, h); ++y) {
                for (std::size_t x = left * n; x < std::min(left + side, w) * n; ++x) {
                    tile[(y - top) * side * n + x - left * n] = values[y * w * n + x];
                }
            }
        }
    }
    const auto t = static_cast<std::uint32_t>(tile_side);
    write_tiff(
        file,
        tiff_entries(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height),
                     static_cast<std::uint32_t>(channels),
                     {{322, TIFF_LONG, 1, t}, {323, TIFF_LONG, 1, t}, {324, TIFF_LONG, 1, 0}, {325, TIFF_LONG, 1, 0}}),
        324, 325, tiles);
}

}  // namespace clerestory::test
