#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace clerestory {

inline constexpr std::uint64_t FNV_START = 0xCBF29CE484222325;
// Any other start gives an independent second half.
inline constexpr std::uint64_t OTHER_FNV_START = 0x9E3779B97F4A7C15;
inline constexpr std::uint64_t FNV_PRIME = 0x100000001B3;

/// FNV-1a, 64 bits, of `bytes`, going on from `hash`.
/// Source: Fowler, Noll, Vo, draft-eastlake-fnv.
constexpr std::uint64_t fnv1a(std::string_view bytes, std::uint64_t hash = FNV_START) {
    for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * FNV_PRIME;
    return hash;
}

/// 128 bits as 32 hexadecimal digits, from two independent starts of FNV-1a: tells contents apart, keeps no secret.
std::string digest_of(std::string_view bytes);
/// The same of a file's content. Throws InputError.
std::string digest_of_file(const std::filesystem::path& file);

}  // namespace clerestory
