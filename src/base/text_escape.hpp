#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace clerestory {

/// Text as it stands in HTML, XML and their quoted attributes.
std::string escaped(std::string_view text);

/// Source: RFC 4648, section 4.
std::string base64(std::string_view bytes);

/// A picture as an address that holds it, so that a page needs no other file.
std::string png_uri(std::string_view png);

/// A file name's suffix with its dot, in lower case: what a file's format is told by.
std::string suffix_of(const std::filesystem::path& file);

/// A word as a shell takes it, quoted where it must be, in one line: control characters and bytes that are no UTF-8 in
/// the form $'\033', which bash, zsh and ksh know and the smallest shells do not.
std::string shell_word(std::string_view word);

/// A file's name as a word that no command takes for a flag.
std::string shell_path(const std::filesystem::path& file);

/// Text as one line that a terminal shows and does not obey: control characters as \n, \t, \x1b or \u009b, bytes that
/// are no UTF-8 as \xff.
std::string one_line(std::string_view text);

}  // namespace clerestory
