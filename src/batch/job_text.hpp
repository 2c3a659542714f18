#pragma once

#include <filesystem>
#include <string>

namespace clerestory {

/// Refuses text that toml++ would take too long for, or too deep into recursion: by its brackets, dots and headers, in
/// one pass that needs no memory. Text that is no TOML passes up to its first mistake; toml++ stops there too.
/// Throws InputError naming the place and the number.
void check_job_text(const std::filesystem::path& file, const std::string& text);

}  // namespace clerestory
