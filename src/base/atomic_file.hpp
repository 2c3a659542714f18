#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/descriptor.hpp"
#include "base/target_path.hpp"

namespace clerestory {

/// Who may read a file that is new, and the folders that are made for it.
enum class Readers {
    umask,     ///< whoever the user's umask lets
    owner,     ///< the user alone
    everyone,  ///< all, and only the user may write, whatever the umask
};

/// From now on whatever this process makes is the user's alone, but for results: an AtomicFile for Readers::umask
/// follows the umask that held until now. For a program's first lines, before any thread.
void keep_all_but_results_private();

/// A file that appears whole or not at all: written under a temporary name beside its target, and renamed by commit().
/// Makes the folders it needs. Without commit() the temporary file is removed, and so are folders made for it.
///
/// A file that is replaced leaves its permissions, its group where the user is in it, and its access list to the new
/// one. Links are followed where follow_target() lets them. The temporary file is locked as long as its writer lives,
/// so that remove_abandoned() can tell it from one that a killed process left. A target that is a device, a pipe or an
/// open file (/dev/null, /dev/stdout) is written as it stands, since it cannot be renamed to. An old file is replaced
/// only by one that is on disk; a new one may lie in memory until sync_remembered(). Throws OutputError.
class AtomicFile {
  public:
    explicit AtomicFile(std::filesystem::path target, Readers readers = Readers::umask);
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;
    ~AtomicFile();

    void write(std::span<const char> bytes);
    void commit();

  private:
    void find_target();
    void open_in_place();
    bool create_temporary();
    void make_folder(int folder, const std::string& name, const std::filesystem::path& made);
    void clean_up() noexcept;

    std::filesystem::path asked_;  ///< as the user calls it
    Readers readers_;
    TargetPath target_;
    std::string temporary_;  ///< its name in the target's folder; empty where there is none
    std::vector<std::filesystem::path> made_folders_;
    Descriptor file_ = Descriptor(-1);  ///< holds the temporary file's lock too
    bool committed_ = false;
};

/// Removes this user's temporary files of processes that were killed while they wrote into `folder`; those of living
/// writers, on this machine or another, and files with any other name stay. Where the file system has no locks nothing
/// is removed. Returns how many went.
std::size_t remove_abandoned(const std::filesystem::path& folder) noexcept;

/// Writes `bytes` to `target`, whole or not at all; makes the folders it needs. Throws OutputError.
void write_bytes(const std::filesystem::path& target, std::span<const char> bytes, Readers readers = Readers::umask);

/// Writes `text` to `target`, whole or not at all; makes the folders it needs. Throws OutputError.
void write_text(const std::filesystem::path& target, std::string_view text, Readers readers = Readers::umask);

}  // namespace clerestory
