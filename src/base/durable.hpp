#pragma once

#include <filesystem>
#include <span>

namespace clerestory {

/// Remembers that `file` stands under its name but may still lie in memory alone, where a power cut takes it, and so
/// may the folders that were made for it. Takes no time.
void remember_unsynced(const std::filesystem::path& file, std::span<const std::filesystem::path> new_folders = {});

/// Waits until what was written to `descriptor` is on disk. Throws OutputError naming `file` where the disk fails; a
/// file system that cannot be asked is passed over.
void sync_file(int descriptor, const std::filesystem::path& file);

/// Waits until all remembered files, and their names, are on disk: each by itself while they are few, else whole file
/// systems at once. To be called before a report or an exit code says that they are there. Throws OutputError naming
/// one of them where the disk fails; file systems that cannot be asked are passed over.
void sync_remembered();

}  // namespace clerestory
