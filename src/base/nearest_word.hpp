#pragma once

#include <string>
#include <vector>

namespace clerestory {

/// The word of `known` that `wrong` was most likely meant to be; empty where none is near.
std::string nearest_word(const std::string& wrong, const std::vector<std::string>& known);

/// A question after a message about `wrong`: "; did you mean WORD?", or nothing where no word is near.
std::string did_you_mean(const std::string& wrong, const std::vector<std::string>& known);

}  // namespace clerestory
