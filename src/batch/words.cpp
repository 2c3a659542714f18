#include "batch/words.hpp"

#include <fmt/format.h>

#include "base/nearest_word.hpp"

namespace clerestory {
namespace {

constexpr std::size_t MOST_QUOTED = 100;  // bytes
constexpr std::size_t LONGEST_WORD = 32;

/// Where to cut so that no character of UTF-8 is cut in two.
std::size_t cut_before(std::string_view text, std::size_t end) {
    constexpr unsigned CONTINUATION_MASK = 0xc0;
    constexpr unsigned CONTINUATION = 0x80;
    constexpr std::size_t MOST_BACK = 3;
    for (std::size_t back = 0; back < MOST_BACK; ++back) {
        if ((static_cast<unsigned char>(text[end]) & CONTINUATION_MASK) != CONTINUATION) break;
        --end;
    }
    return end;
}

}  // namespace

std::string shortened(std::string_view text, std::size_t most) {
    if (text.size() <= most) return std::string(text);
    return fmt::format("{}... ({} bytes)", text.substr(0, cut_before(text, most)), text.size());
}

std::string in_quotes(std::string_view text) {
    if (text.size() <= MOST_QUOTED) return fmt::format("\"{}\"", text);
    return fmt::format("\"{}...\" ({} bytes)", text.substr(0, cut_before(text, MOST_QUOTED)), text.size());
}

std::string near_word(const std::string& wrong, const std::vector<std::string>& known) {
    return wrong.size() > LONGEST_WORD ? std::string() : nearest_word(wrong, known);
}

}  // namespace clerestory
