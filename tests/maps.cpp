#include "maps.hpp"

#include <cmath>
#include <random>

namespace clerestory::test {

RadianceMap make_map(std::size_t width, std::size_t height, const TexelFunction& texel) {
    RadianceMap map;
    map.width = width;
    map.height = height;
    map.rgb = PageBuffer(3 * width * height);
    for (std::size_t row = 0; row < height; ++row) {
        for (std::size_t column = 0; column < width; ++column) {
            const std::array<float, 3> rgb = texel(row, column);
            for (std::size_t c = 0; c < 3; ++c) map.rgb[3 * (row * width + column) + c] = rgb[c];
        }
    }
    return map;
}

namespace {

std::array<float, 3> grey(float value) { return {value, value, value}; }

}  // namespace

RadianceMap constant_map(std::size_t width, std::size_t height, float value) {
    return make_map(width, height, [=](std::size_t, std::size_t) { return grey(value); });
}

RadianceMap lone_texel_map(std::size_t width, std::size_t height, std::size_t row, std::size_t column, float value) {
    return make_map(width, height,
                    [=](std::size_t i, std::size_t j) { return grey(i == row && j == column ? value : 0); });
}

RadianceMap checkerboard_map(std::size_t width, std::size_t height, float value) {
    return make_map(width, height, [=](std::size_t i, std::size_t j) { return grey((i + j) % 2 == 1 ? value : 0); });
}

RadianceMap striped_map(std::size_t width, std::size_t height, bool by_rows, float value) {
    return make_map(width, height,
                    [=](std::size_t i, std::size_t j) { return grey((by_rows ? i : j) % 2 == 1 ? value : 0); });
}

RadianceMap sun_map(std::size_t width, std::size_t height, std::size_t row, std::size_t suns, float sun, float sky,
                    bool at_start) {
    return make_map(width, height, [=](std::size_t i, std::size_t j) {
        const bool is_sun = i == row && (at_start ? j < suns : j >= width - suns);
        return grey(is_sun ? sun : sky);
    });
}

RadianceMap ramp_map(std::size_t width, std::size_t height) {
    return make_map(width, height, [](std::size_t i, std::size_t j) {
        const auto x = static_cast<float>(j + 1);
        const auto y = static_cast<float>(i + 1);
        return std::array<float, 3>{x, y, x + y};
    });
}

RadianceMap random_map(std::size_t width, std::size_t height, unsigned seed) {
    std::mt19937 bits(seed);
    // Of mt19937 only the words are the same everywhere; the library's distributions are not.
    return make_map(width, height, [&](std::size_t, std::size_t) {
        constexpr unsigned BLACK_OF_16 = 3;
        constexpr int LEAST_EXPONENT = -20;
        constexpr unsigned EXPONENTS = 36;
        std::array<float, 3> rgb{};
        if (bits() % 16 < BLACK_OF_16) return rgb;
        const int exponent = LEAST_EXPONENT + static_cast<int>(bits() % EXPONENTS);
        for (float& component : rgb) component = std::ldexp(static_cast<float>(bits() >> 8), exponent - 24);
        return rgb;
    });
}

RadianceMap block_map(std::size_t width, std::size_t height) {
    return make_map(width, height, [=](std::size_t i, std::size_t j) {
        constexpr std::array<std::array<float, 3>, 6> colours = {
            {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 1, 1}, {1, 0, 1}, {1, 1, 0}}};
        return colours.at(3 * (2 * i / height) + 3 * j / width);
    });
}

RadianceMap row_map(std::span<const float> values) {
    return make_map(values.size(), 1, [=](std::size_t, std::size_t j) { return grey(values[j]); });
}

std::vector<NamedMap> hard_maps() {
    std::vector<NamedMap> maps;
    const auto lone = [&](const char* name, std::size_t row, std::size_t column) {
        maps.push_back({name, [=] { return lone_texel_map(64, 32, row, column); }});
    };
    lone("LoneTopLeft", 0, 0);
    lone("LoneTopRight", 0, 63);
    lone("LoneBottomLeft", 31, 0);
    lone("LoneBottomRight", 31, 63);
    lone("LonePoleMiddle", 0, 31);
    lone("LoneSeam", 15, 63);
    lone("LoneCentre", 16, 32);
    const auto sizes = {
        std::pair<std::size_t, std::size_t>{1, 1}, {1, 37}, {37, 1}, {2, 1}, {3, 2}, {257, 89}, {511, 511}, {65537, 2}};
    for (const auto& [width, height] : sizes) {
        const std::string size = std::to_string(width) + "x" + std::to_string(height);
        maps.push_back({"Constant" + size, [w = width, h = height] { return constant_map(w, h, 1); }});
        maps.push_back({"Random" + size, [w = width, h = height] { return random_map(w, h, 7); }});
    }
    maps.push_back({"Ramp", [] { return ramp_map(96, 48); }});
    maps.push_back({"Blocks", [] { return block_map(96, 48); }});
    maps.push_back({"Checkerboard", [] { return checkerboard_map(128, 64, 1e4F); }});
    maps.push_back({"StripedRows", [] { return striped_map(128, 64, true); }});
    maps.push_back({"StripedColumns", [] { return striped_map(128, 64, false); }});
    maps.push_back({"PoleRowsOnly", [] {
                        return make_map(64, 32, [](std::size_t i, std::size_t) { return grey(i % 31 == 0 ? 1 : 0); });
                    }});
    for (const auto& [name, sun] : {std::pair{"1e6", 1e6F}, {"1e9", 1e9F}, {"1e12", 1e12F}}) {
        for (const bool at_start : {true, false}) {
            maps.push_back({std::string("Suns") + name + (at_start ? "AtStart" : "AtEnd"),
                            [s = sun, at_start] { return sun_map(1024, 64, 20, 16, s, 0.05F, at_start); }});
        }
    }
    maps.push_back({"SunsInAnEightKRow", [] { return sun_map(8192, 2, 0, 16, 1e6F, 0.05F, true); }});
    maps.push_back({"Denormal", [] { return constant_map(64, 32, 1e-40F); }});
    maps.push_back({"LeastDenormal", [] { return checkerboard_map(64, 32, 1.4e-45F); }});
    maps.push_back({"RandomDenormal", [] {
                        RadianceMap map = random_map(64, 32, 7);
                        for (std::size_t i = 0; i < map.rgb.size(); ++i) map.rgb[i] = std::ldexp(map.rgb[i], -141);
                        return map;
                    }});
    maps.push_back({"Largest", [] { return constant_map(64, 32, 3e38F); }});
    maps.push_back({"LargestHalf", [] { return constant_map(64, 32, 65504.0F); }});
    maps.push_back({"LargestOverDenormal", [] {
                        return make_map(64, 32, [](std::size_t i, std::size_t j) {
                            return grey(i == 5 && j == 9 ? 3e38F : 1e-40F);
                        });
                    }});
    maps.push_back({"KnownBadVector", [] {
                        constexpr std::array<float, 6> weights = {1.028976e-5F, 1.9611e-4F, 1.028976e-5F,
                                                                  1.028976e-5F, 1.9611e-4F, 1.028976e-5F};
                        return row_map(weights);
                    }});
    return maps;
}

std::vector<std::pair<std::string, RadianceMap>> bundled_maps() {
    std::vector<std::pair<std::string, RadianceMap>> maps;
    for (const char* name : {"city", "interior", "sunset"}) {
        maps.emplace_back(name, read_map(std::string(CLERESTORY_SOURCE_DIR) + "/data/" + name + ".exr", {}));
    }
    return maps;
}

}  // namespace clerestory::test
