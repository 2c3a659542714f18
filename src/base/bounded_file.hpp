#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>

namespace clerestory {

/// A file, a pipe or a device, open. Throws InputError; for folders too, which open and cannot be read.
///   noun  what the file should be, for messages: "a job file"
std::ifstream open_input(const std::filesystem::path& file, const std::string& noun);

/// The text of a file, a pipe or a device, as long as it has at most `most` bytes. Of a longer one no more than that is
/// read: /dev/zero and a pipe that never ends are refused like a large file.
/// Throws InputError.
std::string read_bounded(const std::filesystem::path& file, std::size_t most, const std::string& noun);

/// Throws InputError for a file that is longer, with its size.
[[noreturn]] void refuse_size(const std::filesystem::path& file, std::size_t most, const std::string& noun);

}  // namespace clerestory
