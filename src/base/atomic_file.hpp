#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace clerestory {

/// A file that appears whole or not at all: written under a temporary name beside its target, and renamed by commit().
/// Makes the folders it needs. Without commit() the temporary file is removed, and so are folders made for it.
/// The temporary file is locked as long as its writer lives, so that remove_abandoned() can tell it from one that a
/// killed process left. A target that is a device or a pipe (/dev/null) is written as it stands, since it cannot be
/// renamed to. An old file is replaced only by one that is on disk; a new one may lie in memory until
/// sync_remembered(). Throws OutputError.
class AtomicFile {
  public:
    explicit AtomicFile(std::filesystem::path target);
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;
    ~AtomicFile();

    /// Where to write until commit(): an empty file with the target's suffix.
    [[nodiscard]] const std::filesystem::path& temporary() const noexcept { return temporary_; }
    void commit();

  private:
    bool create_temporary();
    void unlock() noexcept;
    void make_folders(const std::filesystem::path& folder);
    void clean_up() noexcept;

    std::filesystem::path target_;
    std::filesystem::path temporary_;
    std::vector<std::filesystem::path> made_folders_;
    int lock_ = -1;  ///< descriptor that holds the temporary file's lock
    bool in_place_ = false;
    bool committed_ = false;
};

/// Removes temporary files of processes that were killed while they wrote into `folder`; those of living writers, on
/// this machine or another, stay. Where the file system has no locks nothing is removed. Returns how many went.
std::size_t remove_abandoned(const std::filesystem::path& folder) noexcept;

/// Writes `bytes` to `target`, whole or not at all; makes the folders it needs. Throws OutputError.
void write_bytes(const std::filesystem::path& target, std::span<const char> bytes);

/// Writes `text` to `target`, whole or not at all; makes the folders it needs. Throws OutputError.
void write_text(const std::filesystem::path& target, std::string_view text);

}  // namespace clerestory
