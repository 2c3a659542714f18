#include "base/trust.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "base/descriptor.hpp"
#include "base/folder_of.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

std::string system_message() { return std::generic_category().message(errno); }

Descriptor open_folder(int from, const char* name) {
    return Descriptor(::openat(from, name, O_PATH | O_DIRECTORY | O_CLOEXEC));
}

/// Calls `visit` with the state of a folder and of each above it until it returns false. Whether the root was reached.
template <class Visit>
bool walk_up(int folder, Visit visit) {
    struct stat state {};
    if (::fstat(folder, &state) != 0) return false;
    Descriptor at(::fcntl(folder, F_DUPFD_CLOEXEC, 0));
    while (at.get() >= 0 && visit(state)) {
        Descriptor above = open_folder(at.get(), "..");
        struct stat next {};
        if (above.get() < 0 || ::fstat(above.get(), &next) != 0) return false;
        if (next.st_dev == state.st_dev && next.st_ino == state.st_ino) return true;  // the root
        state = next;
        at = std::move(above);
    }
    return false;
}

/// The folder so many steps above one, for a message.
fs::path folder_above(const fs::path& folder, std::size_t steps) {
    std::error_code error;
    fs::path above = fs::canonical(folder, error);
    for (std::size_t i = 0; i < steps; ++i) above = above.parent_path();
    return above;
}

/// The file, opened so that neither a pipe nor a device makes anybody wait.
Descriptor open_file(int folder, const fs::path& file) {
    return Descriptor(::openat(folder, file.filename().c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
}

std::optional<std::string> read_all(int file, std::size_t bytes) {
    std::string text(bytes, '\0');
    for (std::size_t at = 0; at < bytes;) {
        const ssize_t got = ::read(file, text.data() + at, bytes - at);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return std::nullopt;
        at += static_cast<std::size_t>(got);
    }
    return text;
}

}  // namespace

Trust::Trust() : owners_{geteuid(), 0} {}

Trust Trust::beside(const fs::path& program) {
    Trust trust;
    struct stat state {};
    if (::stat(program.c_str(), &state) == 0) {
        trust.owners_.insert(state.st_uid);
        trust.forbidden_ &= ~state.st_mode;
    }
    const Descriptor folder = open_folder(AT_FDCWD, folder_of(program).c_str());
    walk_up(folder.get(), [&](const struct stat& above) {
        trust.program_folders_.emplace(above.st_dev, above.st_ino);
        return true;
    });
    return trust;
}

std::string Trust::doubt_of_folders(int folder, const fs::path& path, bool may_be_sticky) const {
    std::size_t steps = 0;
    std::optional<uid_t> owner_of_unsafe;
    bool is_above_program = false;
    const bool walked = walk_up(folder, [&](const struct stat& state) {
        is_above_program = program_folders_.contains({state.st_dev, state.st_ino});
        if (is_above_program) return false;
        if (!is_safe(state, steps > 0 || may_be_sticky)) owner_of_unsafe = state.st_uid;
        if (!owner_of_unsafe) ++steps;
        return !owner_of_unsafe;
    });
    if (!owner_of_unsafe) return walked || is_above_program ? "" : "the folders above it cannot be looked at";
    const std::string unsafe = folder_above(path, steps).string();
    return is_trusted(*owner_of_unsafe) ? fmt::format("others can write to {}", unsafe)
                                        : fmt::format("{} belongs to user {}", unsafe, *owner_of_unsafe);
}

bool Trust::is_safe(const struct stat& folder, bool may_be_sticky) const {
    const bool is_shared = (folder.st_mode & forbidden_) != 0;
    return is_trusted(folder.st_uid) && (!is_shared || (may_be_sticky && (folder.st_mode & S_ISVTX) != 0));
}

std::string Trust::doubt_of_folder(const fs::path& folder, bool may_be_sticky) const {
    const Descriptor opened = open_folder(AT_FDCWD, folder.c_str());
    return opened.get() < 0 ? system_message() : doubt_of_folders(opened.get(), folder, may_be_sticky);
}

std::string Trust::open(const fs::path& file, Descriptor& opened, struct stat& state) const {
    const Descriptor folder = open_folder(AT_FDCWD, folder_of(file).c_str());
    opened = open_file(folder.get(), file);
    if (opened.get() < 0 || ::fstat(opened.get(), &state) != 0) return system_message();
    const std::string doubt = doubt_of_regular(state);
    return doubt.empty() ? doubt_of_folders(folder.get(), folder_of(file), true) : doubt;
}

std::optional<std::string> Trust::read(const fs::path& file, std::size_t most_bytes) const {
    Descriptor opened(-1);
    struct stat state {};
    if (!open(file, opened, state).empty()) return std::nullopt;
    const auto bytes = static_cast<std::size_t>(state.st_size);
    return bytes <= most_bytes ? read_all(opened.get(), bytes) : std::nullopt;
}

std::string Trust::doubt_of_regular(const struct stat& file) const {
    if (!S_ISREG(file.st_mode)) return "it is no file";
    if (!is_trusted(file.st_uid)) return fmt::format("it belongs to user {}", file.st_uid);
    return (file.st_mode & forbidden_) != 0 ? "others can write to it" : "";
}

std::string Trust::doubt_of_file(const fs::path& file) const {
    Descriptor opened(-1);
    struct stat state {};
    return open(file, opened, state);
}

}  // namespace clerestory
