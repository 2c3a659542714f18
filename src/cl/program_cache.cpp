#include "cl/program_cache.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <string_view>

#include "base/digest.hpp"

namespace clerestory {
namespace {

/// Far beyond any program: PoCL's are some 100 kB, with every kernel that has run 2 MB.
constexpr std::size_t LARGEST_ENTRY = std::size_t{64} << 20;

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
    const auto entry = trust_.read(file_of(key), LARGEST_ENTRY);
    if (!entry) return std::nullopt;
    const std::size_t end = entry->find('\n');
    if (end == std::string::npos) return std::nullopt;
    const auto binary = std::string_view(*entry).substr(end + 1);
    if (entry->substr(0, end + 1) != seal(key, binary)) return std::nullopt;
    return std::vector<unsigned char>(binary.begin(), binary.end());
}

void ProgramCache::store(const std::string& key, const std::vector<unsigned char>& binary) const noexcept {
    if (folder_.empty()) return;
    try {
        const std::string_view text = text_of(binary);
        write_text(file_of(key), seal(key, text).append(text), readers_);
    } catch (const std::exception&) {
        // A folder that cannot be written costs time, not the result.
    }
}

}  // namespace clerestory
