#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

namespace clerestory {

/// Folders that may hold files of the program (`what` is "data" or "modules"), found from where the running program and
/// this library lie, through symbolic links, so that an installed tree can be moved: where the installation puts them,
/// then beside (as in a build folder). Nothing is checked; all are absolute, and none depends on the current folder.
std::vector<std::filesystem::path> install_paths(std::string_view what);

}  // namespace clerestory
