#include "scenes.hpp"

#include <array>
#include <memory>
#include <optional>
#include <tuple>

#include "bundled.hpp"
#include "harness.hpp"

namespace clerestory::bench {
namespace {

constexpr std::size_t SUNS = 16;
constexpr float SUN = 1e6F;
constexpr std::array NAMES = {"even", "city", "suns"};

RadianceMap make_map(Light light, std::size_t width, std::size_t height) {
    std::optional<RadianceMap> photograph;
    if (light == Light::city) photograph = read_map(bundled_map("city"), {});
    RadianceMap map{width, height, PageBuffer(3 * width * height), 0};
    for (std::size_t i = 0; i < height; ++i) {
        for (std::size_t j = 0; j < width; ++j) {
            const std::size_t texel = i * width + j;
            const float uneven = 1 + hashed_fraction(texel) / 2;
            const float* from = nullptr;
            if (photograph) {
                const std::size_t row = i * photograph->height / height;
                from = photograph->rgb.data() + 3 * (row * photograph->width + j * photograph->width / width);
            }
            for (std::size_t c = 0; c < 3; ++c) map.rgb[3 * texel + c] = from ? from[c] * uneven : uneven;
        }
    }
    if (light != Light::suns) return map;
    for (std::size_t k = 0; k < SUNS; ++k) {
        const auto texel = static_cast<std::size_t>(hashed_fraction(k) * static_cast<float>(width * height - 1));
        for (std::size_t c = 0; c < 3; ++c) map.rgb[3 * texel + c] = SUN;
    }
    return map;
}

}  // namespace

const char* light_name(Light light) { return NAMES.at(static_cast<std::size_t>(light)); }

float hashed_fraction(std::size_t index) {
    // The finaliser of splitmix64: Steele, Lea, Flood, Fast splittable pseudorandom number generators, OOPSLA 2014.
    std::uint64_t x = index + 0x9E3779B97F4A7C15U;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9U;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBU;
    return static_cast<float>((x ^ (x >> 31)) >> 40) * 0x1p-24F;
}

LitMap::LitMap(const Device& device, const RadianceMap& lit)
    : map(lit), on_device(device, map), distribution(TableBuilder(device).build(on_device)) {}

const RadianceMap& bench_map(Light light, std::size_t width, std::size_t height) {
    using Key = std::tuple<Light, std::size_t, std::size_t>;
    static std::optional<std::pair<Key, RadianceMap>> last;
    const Key key{light, width, height};
    if (!last || last->first != key) {
        last.reset();
        last.emplace(key, make_map(light, width, height));
    }
    return last->second;
}

LitMap& lit_map(Light light, std::size_t width, std::size_t height, unsigned cores) {
    using Key = std::tuple<Light, std::size_t, std::size_t, unsigned>;
    static std::optional<Key> last_key;
    static std::unique_ptr<LitMap> last;
    const Key key{light, width, height, cores};
    if (last_key != key) {
        last.reset();
        last = std::make_unique<LitMap>(device_of(cores), bench_map(light, width, height));
        last_key = key;
    }
    return *last;
}

}  // namespace clerestory::bench
