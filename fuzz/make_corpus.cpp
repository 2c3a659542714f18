// Writes the inputs that the fuzz target of image files starts from into a folder: one small file of every kind.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

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
    clerestory::test::write_deep_then_flat(folder / "deep_then_flat.exr", plain, colour(Imf::HALF));

    const std::vector<float> rgb = clerestory::test::ramp(3 * WIDTH * HEIGHT);
    clerestory::test::write_pfm(folder / "colour.pfm", WIDTH, HEIGHT, rgb);
    clerestory::test::write_grey_pfm(folder / "grey.pfm", WIDTH, HEIGHT, clerestory::test::ramp(WIDTH * HEIGHT));
    clerestory::test::write_rgbe(folder / "flat.hdr", WIDTH, HEIGHT, std::vector<float>(3 * WIDTH * HEIGHT, 0.5F));
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
