#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace clerestory {

/// Names that glob(3) makes of a pattern's braces: groups that follow one another multiply, nested ones add. Saturates.
std::size_t alternatives_of(const std::string& pattern);

/// Finds files by shell patterns, within the bounds of batch_limits.hpp over all calls together.
class MapGlob {
  public:
    /// Files that a pattern matches, sorted by bytes; jobs that have one pattern in common look once. Throws UsageError
    /// saying which bound the pattern is beyond.
    const std::vector<std::string>& files(const std::string& pattern);

  private:
    std::map<std::string, std::vector<std::string>> found_;  ///< by pattern
    std::size_t alternatives_ = 0;
    std::size_t names_seen_ = 0;
};

}  // namespace clerestory
