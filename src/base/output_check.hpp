#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <tuple>

namespace clerestory {

/// What two paths to one file have in common, links followed: of a file that exists its device and inode; of one that
/// does not yet, those of the nearest folder that does, and the names from there.
struct FileIdentity {
    dev_t device = 0;
    ino_t inode = 0;
    std::string name;  ///< empty where the file exists
    bool operator==(const FileIdentity&) const = default;
    bool operator<(const FileIdentity& other) const {
        return std::tie(device, inode, name) < std::tie(other.device, other.inode, other.name);
    }
};

/// A folder's, whether it exists yet or not; nothing where no part of its path can be looked at.
std::optional<FileIdentity> folder_identity(const std::filesystem::path& folder);

/// Nothing for what is no regular file, such as /dev/null: writing there replaces nothing.
std::optional<FileIdentity> file_identity(const std::filesystem::path& path);

/// Throws UsageError, naming both, where an output is an input or another output by whatever path. "-" and empty paths
/// are passed over.
void check_outputs(std::span<const std::filesystem::path> inputs, std::span<const std::filesystem::path> outputs);

}  // namespace clerestory
