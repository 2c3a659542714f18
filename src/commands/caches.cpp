#include "commands/caches.hpp"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>

#include "base/trust.hpp"

namespace clerestory::commands {
namespace {

namespace fs = std::filesystem;

constexpr const char* PROGRAMS = "CLERESTORY_CACHE_DIR";

/// The user's own cache folder; empty without one.
fs::path user_cache() {
    if (auto cache = folder_named_by("XDG_CACHE_HOME"); !cache.empty()) return cache;
    if (auto home = folder_named_by("HOME"); !home.empty()) return home / ".cache";
    return {};
}

/// Whether a folder is this user's and nobody else can write to it or read it.
bool is_private(const fs::path& folder) {
    struct stat status {};
    return lstat(folder.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == geteuid() &&
           (status.st_mode & (S_IRWXG | S_IRWXO)) == 0;
}

/// A folder that only this user can enter within one that everybody shares: the same at each run, unless somebody else
/// has taken its name. Empty where none can be made.
fs::path own_folder_in(const fs::path& shared) {
    if (!Trust().doubt_of_folder(shared, true).empty()) return {};
    fs::path folder = shared / fmt::format("clerestory-{}", geteuid());
    if (mkdir(folder.c_str(), S_IRWXU) == 0 || is_private(folder)) return folder;
    std::string unique = (shared / "clerestory-XXXXXX").string();
    return mkdtemp(unique.data()) != nullptr ? fs::path(unique) : fs::path();
}

/// As own_folder_in, where temporary files go.
fs::path temporary_folder() {
    for (const fs::path& shared :
         {folder_named_by("TMPDIR"), fs::path("/tmp"), fs::path("/var/tmp"), fs::path("/dev/shm")}) {
        if (shared.empty()) continue;
        if (fs::path folder = own_folder_in(shared); !folder.empty()) return folder;
    }
    return {};
}

/// A folder for compiled kernels, or why there is none.
struct Place {
    fs::path folder;
    std::string why_not;
};

/// `wanted`, which is made if need be, where nobody but this user and root can write to it; a folder of this user's own
/// within where it is one that everybody shares.
///   filled  whether one that root has filled, and that this user can only read, will do
Place safe_place(const fs::path& wanted, bool filled) {
    std::error_code error;
    fs::create_directories(wanted, error);
    if (error) return {{}, fmt::format("{} cannot be written: {}", wanted.string(), error.message())};
    const std::string doubt = Trust().doubt_of_folder(wanted, false);
    if (doubt.empty()) {
        if (access(wanted.c_str(), filled ? R_OK | X_OK : W_OK | X_OK) == 0) return {wanted, {}};
        return {{}, fmt::format("{} cannot be written: {}", wanted.string(), std::strerror(errno))};
    }
    if (fs::path own = own_folder_in(wanted); !own.empty()) return {own, {}};
    return {{}, fmt::format("{} is not used: {}", wanted.string(), doubt)};
}

/// The first place of those that the user names (by a variable) and has (in a cache folder) that will do.
Place first_place(const std::string& variable, const fs::path& cache, const char* within_cache) {
    Place place;
    const auto is_found_in = [&place](const fs::path& wanted, bool filled) {
        const Place next = safe_place(wanted, filled);
        place.folder = next.folder;
        if (place.why_not.empty()) place.why_not = next.why_not;
        return !place.folder.empty();
    };
    const fs::path named = folder_named_by(variable.c_str());
    if (!named.empty() && is_found_in(named, variable == PROGRAMS)) return place;
    if (!cache.empty() && is_found_in(cache / within_cache, false)) return place;
    if (place.why_not.empty()) place.why_not = "neither HOME nor XDG_CACHE_HOME names a folder";
    return place;
}

/// PoCL makes no difference between its own kernels and what others have put there, and without a place that it can
/// write to it has no device.
void tell_pocl(const fs::path& folder) { setenv("POCL_CACHE_DIR", folder.empty() ? "/dev/null" : folder.c_str(), 1); }

Caches find_caches() {
    const fs::path cache = user_cache();
    const Place programs = first_place(PROGRAMS, cache, "clerestory");
    const Place pocl = first_place("POCL_CACHE_DIR", cache, "pocl/kcache");
    const bool complete = !programs.folder.empty() && !pocl.folder.empty();
    const fs::path instead = complete ? fs::path() : temporary_folder();
    Caches caches{programs.folder, {}};
    if (programs.folder.empty() && !instead.empty()) caches.programs = instead / "programs";
    tell_pocl(pocl.folder.empty() && !instead.empty() ? instead / "pocl" : pocl.folder);
    const std::string& why = programs.why_not.empty() ? pocl.why_not : programs.why_not;
    if (!complete && instead.empty()) {
        caches.trouble = fmt::format(
            "compiled kernels cannot be kept, and PoCL cannot work: {}, and no temporary folder is safe from others; "
            "set CLERESTORY_CACHE_DIR and POCL_CACHE_DIR to folders that only you can write to",
            why);
    } else if (!why.empty()) {
        const fs::path& kept = programs.why_not.empty() && !pocl.folder.empty() ? pocl.folder : caches.programs;
        caches.trouble = fmt::format("{}: compiled kernels are kept in {}", why, (complete ? kept : instead).string());
    }
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
