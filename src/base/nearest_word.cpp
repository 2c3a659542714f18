#include "base/nearest_word.hpp"

#include <algorithm>
#include <numeric>
#include <string_view>
#include <utility>

namespace clerestory {
namespace {

/// Number of single-letter changes from one word to the other. Source: Levenshtein, 1966.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = std::exchange(row[0], i + 1);
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t change = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({change, row[j] + 1, row[j + 1] + 1});
        }
    }
    return row.back();
}

}  // namespace

std::string nearest_word(const std::string& wrong, const std::vector<std::string>& known) {
    std::string best;
    std::size_t least = std::max<std::size_t>(2, wrong.size() / 3) + 1;
    for (const auto& word : known) {
        const bool begins = wrong.size() >= 3 && (word.starts_with(wrong) || wrong.starts_with(word));
        const std::size_t distance = begins ? 1 : edit_distance(wrong, word);
        if (distance >= least) continue;
        least = distance;
        best = word;
    }
    return best;
}

std::string did_you_mean(const std::string& wrong, const std::vector<std::string>& known) {
    const std::string word = nearest_word(wrong, known);
    return word.empty() ? word : "; did you mean " + word + "?";
}

}  // namespace clerestory
