#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace clerestory {

/// Words of a file as a message shows them: about `most` bytes of them, whatever their length.
std::string shortened(std::string_view text, std::size_t most = 100);
/// The same in quotes.
std::string in_quotes(std::string_view text);

/// As nearest_word; empty for what is too long to be any word: comparing takes time by length.
std::string near_word(const std::string& wrong, const std::vector<std::string>& known);

}  // namespace clerestory
