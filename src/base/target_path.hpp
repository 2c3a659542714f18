#pragma once

#include <sys/stat.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "base/descriptor.hpp"

namespace clerestory {

/// Where a result will stand, with symbolic links followed: its folder, held open so that nobody can put another in its
/// place meanwhile, and its name there.
struct TargetPath {
    std::filesystem::path path;  ///< as text: for messages, and to sync it
    Descriptor folder = Descriptor(-1);
    std::string name;
    std::optional<struct stat> there;  ///< what stands there now, if anything does
    bool in_place = false;  ///< it is a device, a pipe, or a file that another program has open: no file to replace
};

/// Makes the folder `name` in one that is there; `made` is its path. It may be there by then. Throws OutputError.
using MakeFolder = std::function<void(int folder, const std::string& name, const std::filesystem::path& made)>;

/// Follows `path`; folders that are missing are made by `make_folder`.
///
/// Nobody may lead a user's results elsewhere: a link in place of the result itself must be this user's or root's, and
/// in a sticky folder, where everybody may put something, so must links to folders, pipes and devices, unless they are
/// the folder owner's (the kernel's own rule of protected_symlinks, wherever it is switched off).
/// Throws std::system_error; where a link or a pipe is somebody else's, OutputError.
TargetPath follow_target(const std::filesystem::path& path, const MakeFolder& make_folder);

}  // namespace clerestory
