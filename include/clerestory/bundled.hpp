#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "clerestory/export.hpp"

namespace clerestory {

/// The map that is used where none is given: a city square under a clouded sun, so that a few texels hold most of the
/// light.
inline constexpr std::string_view DEFAULT_MAP = "city";

/// Path of a map that comes with the program, by its name without suffix. Looks in the folder data beside the program
/// or the library, and where the installation puts it, seen from them. Throws InputError.
CLERESTORY_API std::filesystem::path bundled_map(std::string_view name = DEFAULT_MAP);

/// Names that bundled_map knows, sorted; empty where the program's data is not found.
CLERESTORY_API std::vector<std::string> bundled_map_names();

}  // namespace clerestory
