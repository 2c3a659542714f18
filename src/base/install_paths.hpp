#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

namespace clerestory {

/// A folder that may hold files of the program.
struct InstallPath {
    std::filesystem::path folder;   ///< absolute
    std::filesystem::path program;  ///< the file by which it was found: the running program, or this library
};

/// Folders for `what`, "data" or "modules", found from where the running program and this library lie, through symbolic
/// links, so that an installed tree can be moved: where the installation puts them, then beside (as in a build folder).
/// Nothing is checked (see Trust::beside), and none depends on the current folder.
std::vector<InstallPath> install_paths(std::string_view what);

}  // namespace clerestory
