#include "base/bounded_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <system_error>

#include "error.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t READ_BYTES = std::size_t{1} << 16;

/// Pipes and devices do not say how long they are.
std::string size_words(const fs::path& file, std::size_t most) {
    std::error_code error;
    const std::uintmax_t bytes = fs::is_regular_file(file, error) ? fs::file_size(file, error) : 0;
    return !error && bytes > most ? std::to_string(bytes) : fmt::format("more than {}", most);
}

}  // namespace

std::ifstream open_input(const fs::path& file, const std::string& noun) {
    std::error_code error;
    if (fs::is_directory(file, error)) {
        throw InputError(fmt::format("{}: is a folder; name {}", file.string(), noun));
    }
    std::ifstream in(file, std::ios::binary);
    if (!in) {
        throw InputError(fmt::format("{}: cannot be opened: {}; check the path", file.string(),
                                     std::generic_category().message(errno)));
    }
    return in;
}

void refuse_size(const fs::path& file, std::size_t most, const std::string& noun) {
    throw InputError(
        fmt::format("{}:1:1: has {} bytes; {} are the most of {}", file.string(), size_words(file, most), most, noun));
}

std::string read_bounded(const fs::path& file, std::size_t most, const std::string& noun) {
    std::ifstream in = open_input(file, noun);
    std::string text;
    while (in && text.size() <= most) {
        const std::size_t before = text.size();
        text.resize(before + std::min(READ_BYTES, most + 1 - before));
        in.read(text.data() + before, static_cast<std::streamsize>(text.size() - before));
        text.resize(before + static_cast<std::size_t>(in.gcount()));
    }
    if (in.bad()) throw InputError(fmt::format("{}: cannot be read", file.string()));
    if (text.size() > most) refuse_size(file, most, noun);
    return text;
}

}  // namespace clerestory
