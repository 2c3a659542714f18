#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace clerestory {

/// 128 bits as 32 hexadecimal digits: tells contents apart, keeps no secret.
/// Source: XXH3, xxHash.
std::string digest_of(std::string_view bytes);
/// The same of a file's content. Throws InputError.
std::string digest_of_file(const std::filesystem::path& file);

}  // namespace clerestory
