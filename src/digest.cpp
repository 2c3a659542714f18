#include "digest.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <fstream>
#include <system_error>
#include <vector>

#include "error.hpp"

namespace clerestory {
namespace {

class Digest {
  public:
    /// Both halves in one loop: each waits for its own multiplication, so the second costs nothing.
    void add(std::string_view bytes) {
        for (const char c : bytes) {
            first_ = (first_ ^ static_cast<unsigned char>(c)) * FNV_PRIME;
            second_ = (second_ ^ static_cast<unsigned char>(c)) * FNV_PRIME;
        }
    }
    [[nodiscard]] std::string text() const { return fmt::format("{:016x}{:016x}", first_, second_); }

  private:
    std::uint64_t first_ = FNV_START;
    std::uint64_t second_ = OTHER_FNV_START;
};

}  // namespace

std::string digest_of(std::string_view bytes) {
    Digest digest;
    digest.add(bytes);
    return digest.text();
}

std::string digest_of_file(const std::filesystem::path& file) {
    constexpr std::size_t BLOCK = std::size_t{1} << 20;
    std::ifstream in(file, std::ios::binary);
    if (!in) {
        throw InputError(fmt::format("{}: cannot be opened: {}; check the path and its permissions", file.string(),
                                     std::generic_category().message(errno)));
    }
    Digest digest;
    std::vector<char> block(BLOCK);
    while (in) {
        in.read(block.data(), static_cast<std::streamsize>(BLOCK));
        digest.add({block.data(), static_cast<std::size_t>(in.gcount())});
    }
    if (in.bad()) throw InputError(fmt::format("{}: could not be read to its end", file.string()));
    return digest.text();
}

}  // namespace clerestory
