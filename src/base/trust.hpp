#pragma once

#include <sys/stat.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "base/descriptor.hpp"

namespace clerestory {

/// Whose files are believed, where what they hold decides what the program does: built kernels, modules.
///
/// A file is trusted if it is a regular file of this user's or root's that nobody else can write to, and if the same
/// holds for each folder above it; a folder where everybody may write is good enough if it is sticky, as /tmp is,
/// because others can neither replace nor rename in it what isn't theirs. All is asked of open descriptors, so that it
/// holds for what is then read. Links are followed in folders, never to the file itself.
class Trust {
  public:
    /// This user's and root's files.
    Trust();

    /// Files beside `program` too, as its owner has them, and as open to others as it is itself (some file systems show
    /// everything so): whoever can write to the program, or to a folder above it, needs nothing else.
    static Trust beside(const std::filesystem::path& program);

    /// All of a trusted file of up to `most_bytes`; nothing where it isn't there, is longer, or cannot be trusted.
    [[nodiscard]] std::optional<std::string> read(const std::filesystem::path& file, std::size_t most_bytes) const;

    /// Why a file is not trusted, or is not there, for a message; empty: it is.
    [[nodiscard]] std::string doubt_of_file(const std::filesystem::path& file) const;

    /// The same of a folder that exists, and the folders above it. What is executed unchecked (PoCL's kernels) needs
    /// one that is not even sticky.
    [[nodiscard]] std::string doubt_of_folder(const std::filesystem::path& folder, bool may_be_sticky) const;

  private:
    using Identity = std::pair<dev_t, ino_t>;

    /// Opens a file and looks at its state; why it is not trusted, or empty.
    [[nodiscard]] std::string open(const std::filesystem::path& file, Descriptor& opened, struct stat& state) const;
    [[nodiscard]] std::string doubt_of_folders(int folder, const std::filesystem::path& path, bool may_be_sticky) const;
    [[nodiscard]] bool is_safe(const struct stat& folder, bool may_be_sticky) const;
    [[nodiscard]] std::string doubt_of_regular(const struct stat& file) const;
    [[nodiscard]] bool is_trusted(uid_t owner) const { return owners_.contains(owner); }

    std::set<uid_t> owners_;
    mode_t forbidden_ = S_IWGRP | S_IWOTH;  ///< bits of a mode that let others write
    std::set<Identity> program_folders_;    ///< the program's own folder and all above it
};

}  // namespace clerestory
