#pragma once

#include <filesystem>

namespace clerestory {

/// The folder that a file lies in, by its name: "." where it names none.
inline std::filesystem::path folder_of(const std::filesystem::path& file) {
    return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

}  // namespace clerestory
