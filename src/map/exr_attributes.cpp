#include <fmt/format.h>

#include <cstdint>
#include <fstream>
#include <string>
#include <system_error>

#include "error.hpp"
#include "map/image_source.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t LONGEST_NAME = 255;  ///< bytes of a name, "EXR File Layout"

/// A name up to its end mark; longer ones are cut, and the header's reader refuses them.
std::string next_name(std::istream& in) {
    std::string name;
    for (char c = 0; name.size() <= LONGEST_NAME && in.get(c) && c != '\0';) name += c;
    return name;
}

/// Four bytes, little-endian; 0 past the end.
std::uint32_t next_word(std::istream& in) {
    std::uint32_t word = 0;
    for (unsigned shift = 0; shift < 32; shift += 8) {
        const int byte = in.get();
        if (byte >= 0) word |= static_cast<std::uint32_t>(byte) << shift;
    }
    return word;
}

}  // namespace

void check_exr_attributes(const fs::path& file) {
    constexpr std::uint32_t MULTI_PART = 0x1000;
    std::error_code error;
    const std::uintmax_t length = fs::file_size(file, error);
    std::ifstream in(file, std::ios::binary);
    if (error || !in) return;  // opening it says why
    next_word(in);             // the magic number
    const bool many_parts = (next_word(in) & MULTI_PART) != 0;
    // A header ends with an empty name, and a file of several parts with an empty header.
    for (bool header_begins = true; in;) {
        const std::string name = next_name(in);
        if (name.empty()) {
            if (!many_parts || header_begins) return;
            header_begins = true;
            continue;
        }
        header_begins = false;
        next_name(in);  // its type
        const std::uint32_t size = next_word(in);
        if (size > length) {
            throw InputError(
                fmt::format("{}: damaged or cut short (an attribute claims {} of the file's {} bytes); get "
                            "the file anew",
                            file.string(), size, length));
        }
        in.seekg(size, std::ios::cur);
    }
}

}  // namespace clerestory
