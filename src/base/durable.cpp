#include "base/durable.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <map>
#include <mutex>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "base/descriptor.hpp"
#include "base/folder_of.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// Up to so many files are synced one by one; more cost less by file systems, which write whatever others have left
/// there too.
constexpr std::size_t FEW = 16;

/// What is remembered.
struct Unsynced {
    std::vector<fs::path> files;             ///< the first FEW
    bool many = false;                       ///< there were more
    std::set<fs::path> folders;              ///< with new entries, of the first FEW
    std::map<dev_t, fs::path> file_systems;  ///< a folder of each
};

std::mutex mutex;
Unsynced unsynced;

bool cannot_be_asked(int code) {
    return code == EINVAL || code == ENOTSUP || code == ENOSYS || code == EROFS || code == EBADF;
}

void sync_with(int (*sync)(int), int descriptor, const fs::path& file) {
    if (sync(descriptor) == 0 || cannot_be_asked(errno)) return;
    throw OutputError(fmt::format("{}: could not be brought to disk: {}; check the disk, then write it again",
                                  file.string(), std::generic_category().message(errno)));
}

/// What has gone, or may not be opened, meanwhile is somebody else's.
void sync_path(int (*sync)(int), const fs::path& path) {
    const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
    if (file.get() >= 0) sync_with(sync, file.get(), path);
}

}  // namespace

void sync_file(int descriptor, const fs::path& file) { sync_with(::fsync, descriptor, file); }

void remember_unsynced(const fs::path& file, std::span<const fs::path> new_folders) {
    const fs::path folder = folder_of(file);
    struct stat status {};
    if (::stat(folder.c_str(), &status) != 0) return;
    const std::lock_guard lock(mutex);
    unsynced.file_systems.try_emplace(status.st_dev, folder);
    unsynced.many = unsynced.many || unsynced.files.size() == FEW;
    if (unsynced.many) return;
    unsynced.files.push_back(file);
    unsynced.folders.insert(folder);
    for (const fs::path& made : new_folders) unsynced.folders.insert(folder_of(made));
}

void sync_remembered() {
    Unsynced taken;
    {
        const std::lock_guard lock(mutex);
        std::swap(taken, unsynced);
    }
    if (taken.many) {
        for (const auto& [device, folder] : taken.file_systems) sync_path(::syncfs, folder);
        return;
    }
    for (const fs::path& file : taken.files) sync_path(::fsync, file);
    for (const fs::path& folder : taken.folders) sync_path(::fsync, folder);
}

}  // namespace clerestory
