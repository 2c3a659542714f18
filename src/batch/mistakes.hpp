#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

namespace clerestory {

/// A place in the job file, counted from 1.
struct Place {
    std::size_t line = 1;
    std::size_t column = 1;
};

/// "file:line:column: what", as compilers write it.
std::string located(const std::filesystem::path& file, const Place& place, const std::string& what);

/// Mistakes of a job file: the first ones by place are kept, however many are found.
class Mistakes {
  public:
    explicit Mistakes(std::filesystem::path file) : file_(std::move(file)) {}

    void add(const Place& place, const std::string& what);
    /// Whether a mistake at this place would be told: words for others need not be made. Notes that there is one.
    bool wanted(const Place& place);

    [[nodiscard]] bool empty() const noexcept { return lines_.empty(); }
    /// No more of them are told.
    [[nodiscard]] bool full() const noexcept { return more_; }
    /// Throws InputError with a line for each.
    void throw_if_any() const;

  private:
    std::filesystem::path file_;
    std::multimap<std::pair<std::size_t, std::size_t>, std::string> lines_;  ///< by place
    bool more_ = false;
};

}  // namespace clerestory
