#include "cl/pocl_bitcode.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <utility>

namespace clerestory {
namespace {

// How PoCL stores a file in a binary: its name, the length of what follows as 32 bits, its bytes. From version 1.0 on;
// source: PoCL, lib/CL/pocl_binary.c, serialize_file.
constexpr std::string_view FILE_NAME = "/program.bc";
// What LLVM bitcode begins with. Source: LLVM Bitcode File Format, Magic Numbers.
constexpr std::array<unsigned char, 4> BITCODE_MAGIC = {'B', 'C', 0xC0, 0xDE};

}  // namespace

bool is_pocl(const DeviceInfo& info) { return info.platform == "Portable Computing Language"; }

bool has_clang_builtins(const DeviceInfo& info) {
    // "OpenCL 3.0 PoCL 3.1+debian ..."
    constexpr std::string_view NAME = "PoCL ";
    const auto at = info.version.find(NAME);
    int major = 0;
    int minor = 0;
    return is_pocl(info) && at != std::string::npos &&
           std::sscanf(info.version.c_str() + at + NAME.size(), "%d.%d", &major, &minor) == 2 &&
           std::pair(major, minor) >= std::pair(3, 1);
}

std::optional<std::vector<unsigned char>> bitcode_in(const std::vector<unsigned char>& binary) {
    const auto name = std::search(binary.begin(), binary.end(), FILE_NAME.begin(), FILE_NAME.end());
    std::uint32_t length = 0;
    const auto left = static_cast<std::size_t>(binary.end() - name);
    if (left < FILE_NAME.size() + sizeof(length)) return std::nullopt;
    const auto at = name + static_cast<std::ptrdiff_t>(FILE_NAME.size());
    std::memcpy(&length, &*at, sizeof(length));
    const auto begin = at + sizeof(length);
    if (length < BITCODE_MAGIC.size() || length > left - FILE_NAME.size() - sizeof(length)) return std::nullopt;
    if (!std::equal(BITCODE_MAGIC.begin(), BITCODE_MAGIC.end(), begin)) return std::nullopt;
    return std::vector<unsigned char>(begin, begin + static_cast<std::ptrdiff_t>(length));
}

std::optional<std::vector<unsigned char>> compile_to_bitcode(const Device& device, const std::string& source,
                                                             const std::string& options) {
    try {
        cl::Program object(device.context(), source);
        object.compile(options.c_str());
        const auto binaries = object.getInfo<CL_PROGRAM_BINARIES>();
        if (binaries.size() != 1) return std::nullopt;
        return bitcode_in(binaries.front());
    } catch (const cl::Error&) {
        return std::nullopt;
    }
}

}  // namespace clerestory
