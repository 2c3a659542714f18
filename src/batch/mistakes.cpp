#include "batch/mistakes.hpp"

#include <fmt/format.h>

#include <iterator>

#include "batch/batch_limits.hpp"
#include "error.hpp"

namespace clerestory {

using batch_limits::MOST_MISTAKES;

std::string located(const std::filesystem::path& file, const Place& place, const std::string& what) {
    return fmt::format("{}:{}:{}: {}", file.string(), place.line, place.column, what);
}

bool Mistakes::wanted(const Place& place) {
    if (lines_.size() < MOST_MISTAKES) return true;
    more_ = true;
    return std::pair(place.line, place.column) < std::prev(lines_.end())->first;
}

void Mistakes::add(const Place& place, const std::string& what) {
    if (!wanted(place)) return;
    lines_.emplace(std::pair(place.line, place.column), located(file_, place, what));
    if (lines_.size() > MOST_MISTAKES) lines_.erase(std::prev(lines_.end()));
}

void Mistakes::throw_if_any() const {
    std::vector<std::string> all;
    for (const auto& [place, line] : lines_) all.push_back(line);
    if (more_) all.push_back(fmt::format("{}: and more of the kind", file_.string()));
    if (!all.empty()) throw InputError(all);
}

}  // namespace clerestory
