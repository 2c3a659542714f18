// Writes the inputs that the fuzz target of image files starts from into a folder: one small file of every kind.
#include <ImfStandardAttributes.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "coded_files.hpp"
#include "image_files.hpp"

namespace {

namespace fs = std::filesystem;
using clerestory::test::channel;
using clerestory::test::ExrChannel;
using clerestory::test::ExrLayout;

constexpr int WIDTH = 5;
constexpr int HEIGHT = 3;

std::vector<ExrChannel> colour(Imf::PixelType type) {
    const std::vector<float> rgba = clerestory::test::ramp(4 * WIDTH * HEIGHT);
    std::vector<ExrChannel> channels;
    for (const auto& [name, c] : {std::pair{"R", 0U}, {"G", 1U}, {"B", 2U}, {"A", 3U}}) {
        channels.push_back({name, type, channel(rgba, c, 4)});
    }
    return channels;
}

/// TIFF, PNG and JPEG in every form, small enough for libFuzzer's longest input.
void write_coded_files(const fs::path& folder) {
    using namespace clerestory::test;
    constexpr std::uint16_t JPEG = 7;
    std::vector<TiffForm> tiffs = tiff_forms();
    tiffs.push_back({.name = "jpeg", .bits = 8, .is_float = false, .compression = JPEG, .rows_per_strip = 8});
    tiffs.push_back({.name = "palette", .samples = 1, .bits = 8, .is_float = false, .is_palette = true});
    for (TiffForm& form : tiffs) {
        form.width = std::min(form.width, 16);
        form.height = std::min(form.height, 16);
        write_coded_tiff(folder / (form.name + ".tif"), form);
    }
    for (const PngForm& form : png_forms()) write_coded_png(folder / (form.name + ".png"), form);
    for (const JpegForm& form : jpeg_forms()) write_coded_jpeg(folder / (form.name + ".jpg"), form);
}

void write_corpus(const fs::path& folder) {
    fs::create_directories(folder);
    const std::vector<std::pair<std::string, Imf::Compression>> compressions = {
        {"none", Imf::NO_COMPRESSION},  {"rle", Imf::RLE_COMPRESSION},   {"zips", Imf::ZIPS_COMPRESSION},
        {"zip", Imf::ZIP_COMPRESSION},  {"piz", Imf::PIZ_COMPRESSION},   {"pxr24", Imf::PXR24_COMPRESSION},
        {"b44", Imf::B44_COMPRESSION},  {"b44a", Imf::B44A_COMPRESSION}, {"dwaa", Imf::DWAA_COMPRESSION},
        {"dwab", Imf::DWAB_COMPRESSION}};
    for (const auto& [name, compression] : compressions) {
        ExrLayout layout{.width = WIDTH, .height = HEIGHT};
        layout.compression = compression;
        write_test_exr(folder / (name + ".exr"), layout, colour(Imf::HALF));
    }
    const ExrLayout plain{.width = WIDTH, .height = HEIGHT};
    ExrLayout tiles = plain;
    tiles.tile_side = 2;
    write_test_exr(folder / "tiles.exr", tiles, colour(Imf::FLOAT));
    tiles.mip_levels = true;
    write_test_exr(folder / "mip_levels.exr", tiles, colour(Imf::FLOAT));
    ExrLayout moved = plain;
    moved.origin_x = -7;
    moved.origin_y = 11;
    write_test_exr(folder / "moved.exr", moved, colour(Imf::UINT));
    write_test_exr(folder / "grey.exr", plain, {{"Y", Imf::FLOAT, clerestory::test::ramp(WIDTH * HEIGHT)}});
    ExrLayout cropped = moved;
    cropped.edit = [](Imf::Header& header) { header.displayWindow() = Imath::Box2i({-5, 10}, {0, 12}); };
    write_test_exr(folder / "cropped.exr", cropped, colour(Imf::HALF));
    cropped.tile_side = 2;
    write_test_exr(folder / "cropped_tiles.exr", cropped, colour(Imf::FLOAT));
    ExrLayout cube = plain;
    cube.edit = [](Imf::Header& header) { Imf::addEnvmap(header, Imf::ENVMAP_CUBE); };
    write_test_exr(folder / "cube.exr", cube, colour(Imf::HALF));
    std::vector<ExrChannel> layers;
    for (const char* layer : {"View.AO.", "View.Combined.", "View.CryptoObject00."}) {
        for (ExrChannel channel : colour(Imf::HALF)) {
            channel.name = layer + channel.name;
            layers.push_back(channel);
        }
    }
    write_test_exr(folder / "layers.exr", plain, layers);
    const std::vector<float> depth = clerestory::test::ramp(WIDTH * HEIGHT);
    clerestory::test::write_exr_parts(folder / "parts.exr", plain,
                                      {{"depth", {{"Z", Imf::FLOAT, depth}}}, {"rgba", colour(Imf::HALF)}});
    // Chroma has half the resolution, so that sizes are even.
    clerestory::test::write_chroma_exr(folder / "chroma.exr", 6, 4, clerestory::test::ramp(3 * 6 * 4));
    clerestory::test::write_deep_then_flat(folder / "deep_then_flat.exr", plain, colour(Imf::HALF));

    const std::vector<float> rgb = clerestory::test::ramp(3 * WIDTH * HEIGHT);
    clerestory::test::write_pfm(folder / "colour.pfm", WIDTH, HEIGHT, rgb);
    clerestory::test::write_grey_pfm(folder / "grey.pfm", WIDTH, HEIGHT, clerestory::test::ramp(WIDTH * HEIGHT));
    clerestory::test::write_rgbe(folder / "flat.hdr", WIDTH, HEIGHT, std::vector<float>(3 * WIDTH * HEIGHT, 0.5F));
    const std::string lead =
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\nPRIMARIES=1 0 0 1 0 0 .3 .3\n\n-Y 1 +X 9\n";
    clerestory::test::write_raw(folder / "runs.hdr", lead + std::string("\2\2\0\11"
                                                                        "\210\12\1\13"
                                                                        "\210\24\1\25"
                                                                        "\210\36\1\37"
                                                                        "\211\210",
                                                                        18));
    clerestory::test::write_raw(folder / "old_runs.hdr", lead + std::string("\12\24\36\210"
                                                                            "\1\1\1\7"
                                                                            "\13\25\37\210",
                                                                            12));
    const std::string values(4 * 3 * 2 * 4, '\100');
    clerestory::test::write_raw(folder / "carriage_returns.pfm", "PF\r\n4 2\r\n-1.0\r\n" + values);
    clerestory::test::write_raw(folder / "blanks.pfm", "PF \n4 2 \n# by hand\n-1.0 \n" + values);
    clerestory::test::write_raw(folder / "photoshop.pfm", "PF\n4\n2\n1.000000\n" + values);
    write_coded_files(folder);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: make_fuzz_corpus FOLDER\n");
        return 2;
    }
    try {
        write_corpus(argv[1]);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "make_fuzz_corpus: %s\n", error.what());
        return 5;
    }
    return 0;
}
