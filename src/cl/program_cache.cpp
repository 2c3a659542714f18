#include "cl/program_cache.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <string_view>

#include "base/atomic_file.hpp"
#include "base/digest.hpp"

namespace clerestory {
namespace {

/// A line that leads an entry: what it is, and a digest of the key and the binary.
std::string seal(const std::string& key, std::string_view binary) {
    return fmt::format("clerestory program {}\n", digest_of(digest_of(key) + digest_of(binary)));
}

std::string_view text_of(const std::vector<unsigned char>& bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

std::filesystem::path ProgramCache::file_of(const std::string& key) const {
    return folder_ / (digest_of(key) + ".clprogram");
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
