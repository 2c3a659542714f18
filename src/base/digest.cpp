#include "base/digest.hpp"

#include <fmt/format.h>
#include <xxhash.h>

#include <cerrno>
#include <fstream>
#include <memory>
#include <new>
#include <system_error>
#include <vector>

#include "error.hpp"

namespace clerestory {
namespace {

std::string text_of(XXH128_hash_t hash) { return fmt::format("{:016x}{:016x}", hash.high64, hash.low64); }

}  // namespace

std::string digest_of(std::string_view bytes) { return text_of(XXH3_128bits(bytes.data(), bytes.size())); }

std::string digest_of_file(const std::filesystem::path& file) {
    constexpr std::size_t BLOCK = std::size_t{1} << 20;
    std::ifstream in(file, std::ios::binary);
    if (!in) {
        throw InputError(fmt::format("{}: cannot be opened: {}; check the path and its permissions", file.string(),
                                     std::generic_category().message(errno)));
    }
    const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(), XXH3_freeState);
    if (!state || XXH3_128bits_reset(state.get()) != XXH_OK) throw std::bad_alloc();
    std::vector<char> block(BLOCK);
    while (in) {
        in.read(block.data(), static_cast<std::streamsize>(BLOCK));
        (void)XXH3_128bits_update(state.get(), block.data(), static_cast<std::size_t>(in.gcount()));
    }
    if (in.bad()) throw InputError(fmt::format("{}: could not be read to its end", file.string()));
    return text_of(XXH3_128bits_digest(state.get()));
}

}  // namespace clerestory
