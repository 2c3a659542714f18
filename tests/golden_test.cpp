#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>

#include "lit_map.hpp"
#include "maps.hpp"
#include "test_device.hpp"

namespace clerestory {
namespace {

using namespace test;

constexpr std::size_t DRAWS = 1'000'000;
constexpr std::uint64_t SEED = 1;

/// FNV-1a, 64 bits, over the bytes as they lie in memory (little-endian).
/// Source: Fowler, Noll, Vo, draft-eastlake-fnv.
std::uint64_t fnv1a(std::span<const std::byte> bytes) {
    std::uint64_t hash = 0xcbf29ce484222325;
    for (const std::byte byte : bytes) hash = (hash ^ static_cast<std::uint64_t>(byte)) * 0x100000001b3;
    return hash;
}

template <class T>
std::string digest(const std::vector<T>& values) {
    return fmt::format("{:016x}", fnv1a(std::as_bytes(std::span(values))));
}

nlohmann::json digests(const Device& device, RadianceMap&& made) {
    SamplingOptions options;
    options.seed = SEED;
    LitMap lit(device, std::move(made), options);
    const std::vector<float> texels(lit.map.rgb.data(), lit.map.rgb.data() + lit.map.rgb.size());
    return {{"map", digest(texels)},
            {"conditional", digest(lit.conditional)},
            {"marginal", digest(lit.marginal)},
            {"draws", digest(lit.sampler.draw(DRAWS).texel.download())}};
}

/// Maps by name: what no decoder touches, and the bundled ones.
std::vector<std::pair<std::string, RadianceMap>> golden_maps() {
    auto maps = bundled_maps();
    maps.emplace_back("random_257x89", random_map(257, 89, 7));
    maps.emplace_back("suns_1024x512", sun_map(1024, 512, 200, 16, 1e9F, 0.05F, false));
    return maps;
}

const std::string GOLDENS = std::string(CLERESTORY_SOURCE_DIR) + "/tests/goldens.json";

/// Tables and a million draws are the same bits as when the goldens were written, on any device. tests/README.md says
/// when they may be written anew.
TEST(Golden, TablesAndDrawsAreTheBitsThatWereCommitted) {
    const TestDevice device;
    nlohmann::json found;
    for (auto& [name, map] : golden_maps()) found[name] = digests(device, std::move(map));
    if (std::getenv("CLERESTORY_WRITE_GOLDENS") != nullptr) {
        std::ofstream(GOLDENS) << found.dump(2) << '\n';
        FAIL() << "goldens were written to " << GOLDENS
               << "; look at the difference and run again without the variable";
    }
    const nlohmann::json wanted = nlohmann::json::parse(std::ifstream(GOLDENS));
    ASSERT_EQ(wanted.size(), found.size());
    std::size_t held = 0;
    for (const auto& [name, golden] : wanted.items()) {
        // Lossy DWA files decode to other last bits on other kinds of processors; then there is no golden for the map.
        if (name.find('_') == std::string::npos && golden["map"] != found[name]["map"]) continue;
        EXPECT_EQ(found[name], golden) << name;
        ++held;
    }
    EXPECT_GE(held, 2U) << "maps that no decoder touches are always held";
}

}  // namespace
}  // namespace clerestory
