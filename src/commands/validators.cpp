#include "commands/validators.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

#include "base/nearest_word.hpp"

namespace clerestory::commands {

CLI::Validator finite_between(double low, double high) {
    return {[low, high](std::string& text) -> std::string {
                double value = 0;
                if (!CLI::detail::lexical_cast(text, value) || !std::isfinite(value) || value < low || value > high) {
                    return fmt::format("{} is not a number from {} to {}", text, low, high);
                }
                return {};
            },
            fmt::format("{}..{}", low, high)};
}

CLI::Validator whole_number(std::uint64_t low, std::uint64_t high) {
    const auto check = [low, high](std::string& text) -> std::string {
        std::uint64_t value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        const bool whole = end == text.data() + text.size() && error == std::errc();
        if (!whole || value < low || value > high) {
            return fmt::format("{} is not a whole number from {} to {}", text, low, high);
        }
        text = std::to_string(value);
        return {};
    };
    const bool bounded = high != std::numeric_limits<std::uint64_t>::max();
    return {check, bounded ? fmt::format("{}..{}", low, high) : std::string()};
}

CLI::Validator one_of(const std::vector<std::string>& words) {
    const auto check = [words](std::string& text) -> std::string {
        if (std::find(words.begin(), words.end(), text) != words.end()) return {};
        return fmt::format("{} is not one of {}{}", text, fmt::join(words, ", "), did_you_mean(text, words));
    };
    return {check, fmt::format("{{{}}}", fmt::join(words, ","))};
}

CLI::Validator not_empty() {
    return {[](std::string& text) { return std::string(text.empty() ? "the name is empty" : ""); }, ""};
}

CLI::Validator output_name() {
    const auto check = [](std::string& text) -> std::string {
        if (text.empty()) return "the name is empty";
        if (text.size() == 1 || text.front() != '-') return {};
        return fmt::format("{} looks like a flag; write ./{} for a file of that name", text, text);
    };
    return {check, ""};
}

}  // namespace clerestory::commands
