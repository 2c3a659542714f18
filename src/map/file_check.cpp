#include "map/file_check.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>

namespace clerestory::file_check {

File open_file(const char* file, std::uint64_t& length) {
    File opened(std::fopen(file, "rbe"));
    struct stat state {};
    if (!opened || ::fstat(::fileno(opened.get()), &state) != 0) {
        throw Refusal(fmt::format("cannot be opened: {}; check its permissions", std::strerror(errno)));
    }
    length = static_cast<std::uint64_t>(state.st_size);
    return opened;
}

void check_claim(std::uint64_t width, std::uint64_t height, double decoded, double most, std::uint64_t length) {
    if (decoded <= most * static_cast<double>(length)) return;
    throw Damage(fmt::format("{} bytes cannot hold {} x {} texels", length, width, height));
}

}  // namespace clerestory::file_check
