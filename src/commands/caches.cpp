#include "commands/caches.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>

namespace clerestory::commands {
namespace {

namespace fs = std::filesystem;

/// The user's own cache folder; empty without one.
fs::path user_cache() {
    if (auto cache = folder_named_by("XDG_CACHE_HOME"); !cache.empty()) return cache;
    if (auto home = folder_named_by("HOME"); !home.empty()) return home / ".cache";
    return {};
}

/// Why nothing can be written in a folder, which is made if need be; empty: it can.
std::string why_unwritable(const fs::path& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (!error && access(folder.c_str(), W_OK | X_OK) == 0) return {};
    return fmt::format("{} cannot be written: {}", folder.string(), error ? error.message() : std::strerror(errno));
}

/// Whether a folder is this user's and nobody else can write to it or read it.
bool is_private(const fs::path& folder) {
    struct stat status {};
    return lstat(folder.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == geteuid() &&
           (status.st_mode & (S_IRWXG | S_IRWXO)) == 0;
}

/// A folder under the temporary directory that only this user can enter: the same at each run, unless somebody else has
/// taken its name. Empty where none can be made.
fs::path private_folder() {
    fs::path temporary = folder_named_by("TMPDIR");
    if (temporary.empty()) temporary = "/tmp";
    fs::path folder = temporary / fmt::format("clerestory-{}", geteuid());
    if (mkdir(folder.c_str(), S_IRWXU) == 0 || is_private(folder)) return folder;
    std::string unique = (temporary / "clerestory-XXXXXX").string();
    return mkdtemp(unique.data()) != nullptr ? fs::path(unique) : fs::path();
}

Caches find_caches() {
    Caches caches;
    const fs::path cache = user_cache();
    caches.programs = folder_named_by("CLERESTORY_CACHE_DIR");
    const char* named = std::getenv("POCL_CACHE_DIR");
    const bool pocl_named = named != nullptr && *named != '\0';
    if (!caches.programs.empty() && pocl_named) return caches;
    const std::string why = cache.empty() ? "neither HOME nor XDG_CACHE_HOME names a folder" : why_unwritable(cache);
    if (why.empty()) {
        if (caches.programs.empty()) caches.programs = cache / "clerestory";
        return caches;
    }
    const fs::path instead = private_folder();
    if (instead.empty()) {
        caches.trouble = fmt::format(
            "compiled kernels cannot be kept: {}, and no folder can be made in the temporary "
            "directory; set CLERESTORY_CACHE_DIR and POCL_CACHE_DIR",
            why);
        return caches;
    }
    if (caches.programs.empty()) caches.programs = instead / "programs";
    if (!pocl_named) setenv("POCL_CACHE_DIR", (instead / "pocl").c_str(), 1);
    caches.trouble = fmt::format("{}: compiled kernels are kept in {}", why, instead.string());
    return caches;
}

}  // namespace

fs::path folder_named_by(const char* variable) {
    const char* value = std::getenv(variable);
    fs::path folder = value == nullptr ? "" : value;
    return folder.is_absolute() ? folder : fs::path();
}

const Caches& prepare_caches() {
    static const Caches caches = find_caches();
    return caches;
}

}  // namespace clerestory::commands
