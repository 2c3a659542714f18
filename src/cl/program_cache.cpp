#include "cl/program_cache.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <string_view>

#include "atomic_file.hpp"

namespace clerestory {
namespace {

/// FNV-1a, 64 bits, from a given start.
/// Source: Fowler, Noll, Vo, draft-eastlake-fnv.
std::uint64_t fnv1a(std::string_view bytes, std::uint64_t hash) {
    constexpr std::uint64_t PRIME = 0x100000001B3;
    for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * PRIME;
    return hash;
}
constexpr std::uint64_t FNV_START = 0xCBF29CE484222325;
// Any other start gives an independent second half of a name.
constexpr std::uint64_t OTHER_START = 0x9E3779B97F4A7C15;

/// A line that leads an entry: what it is, and a digest of the key and the binary.
std::string seal(const std::string& key, std::string_view binary) {
    return fmt::format("clerestory program {:016x}\n", fnv1a(binary, fnv1a(key, FNV_START)));
}

std::string_view text_of(const std::vector<unsigned char>& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

std::filesystem::path ProgramCache::file_of(const std::string& key) const {
    return folder_ / fmt::format("{:016x}{:016x}.clprogram", fnv1a(key, FNV_START), fnv1a(key, OTHER_START));
}

std::optional<std::vector<unsigned char>> ProgramCache::load(const std::string& key) const {
    if (folder_.empty()) return std::nullopt;
    std::ifstream file(file_of(key), std::ios::binary);
    std::string line;
    if (!std::getline(file, line)) return std::nullopt;
    std::vector<unsigned char> binary{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    if (line + "\n" != seal(key, text_of(binary))) return std::nullopt;
    return binary;
}

void ProgramCache::store(const std::string& key, const std::vector<unsigned char>& binary) const noexcept {
    if (folder_.empty()) return;
    try {
        const std::string_view text = text_of(binary);
        write_text(file_of(key), seal(key, text).append(text));
    } catch (const std::exception&) {
        // A folder that cannot be written costs time, not the result.
    }
}

}  // namespace clerestory
