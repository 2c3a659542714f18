#include "batch/pattern.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string_view>

#include "batch/words.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

constexpr std::size_t LARGEST_WIDTH = 20;
constexpr const char* MISSING_VALUE = "none";

bool is_number_field(std::string_view field) {
    return field == "rotation" || field == "frame" || field == "samples" || field == "seed" || field == "size";
}

/// The whole part with zeros up to `width` digits, whatever follows it.
std::string padded(std::string digits, std::size_t width) {
    const std::size_t sign = digits.starts_with('-') ? 1 : 0;
    const std::size_t whole = std::min(digits.find('.'), digits.size()) - sign;
    if (whole < width) digits.insert(sign, width - whole, '0');
    return digits;
}

std::string number(double value, std::optional<int> precision) {
    if (precision) return fmt::format("{:.{}f}", value, *precision);
    std::string shortest = fmt::format("{}", value);
    if (shortest.find('e') != std::string::npos) shortest = fmt::format("{:f}", value);
    return shortest;
}

std::string of_whole(const std::optional<std::uint64_t>& value, std::size_t width) {
    return value ? padded(std::to_string(*value), width) : MISSING_VALUE;
}

}  // namespace

const std::vector<std::string>& Pattern::fields() {
    static const std::vector<std::string> names = {"map",       "folder",   "rotation", "frame", "samples",
                                                   "estimator", "sequence", "seed",     "size"};
    return names;
}

Pattern::Pattern(const std::string& text) : text_(text) {
    std::string literal;
    const auto flush = [&] {
        if (!literal.empty()) parts_.push_back({std::exchange(literal, {}), {}, 0, {}});
    };
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (c != '{' && c != '}') {
            literal += c;
        } else if (i + 1 < text.size() && text[i + 1] == c) {
            literal += c;
            ++i;
        } else if (const std::size_t end = text.find('}', i); c == '{' && end != std::string::npos) {
            flush();
            add_field(text.substr(i + 1, end - i - 1));
            i = end;
        } else {
            throw UsageError(
                fmt::format("{} has a lone {}; write {}{} for the character itself", in_quotes(text), c, c, c));
        }
    }
    flush();
}

void Pattern::add_field(const std::string& inside) {
    const std::size_t colon = inside.find(':');
    Part part;
    part.field = inside.substr(0, colon);
    const auto& known = fields();
    if (std::find(known.begin(), known.end(), part.field) == known.end()) {
        const std::string near = near_word(part.field, known);
        const std::string meant = near.empty() ? fmt::format("it may have {{{}}}", fmt::join(known, "}, {"))
                                               : fmt::format("did you mean {{{}}}?", near);
        throw UsageError(fmt::format("{} has no field {{{}}}; {}", in_quotes(text_), shortened(part.field), meant));
    }
    if (colon != std::string::npos) {
        const std::string form = inside.substr(colon + 1);
        const std::size_t point = std::min(form.find('.'), form.size());
        const std::string width = form.substr(0, point);
        const std::string digits = point < form.size() ? form.substr(point + 1) : "0";
        const auto is_count = [](const std::string& t) {
            return !t.empty() && t.size() <= 3 &&
                   std::all_of(t.begin(), t.end(), [](unsigned char d) { return std::isdigit(d); }) &&
                   std::stoul(t) <= LARGEST_WIDTH;
        };
        const bool has_precision = point < form.size();
        const bool right = (is_count(width) || (width.empty() && has_precision)) && is_count(digits) &&
                           is_number_field(part.field) && (!has_precision || part.field == "rotation");
        if (!right) {
            throw UsageError(
                fmt::format("{}: {{{}}} cannot be written; numbers take a width, as {{samples:05}}, "
                            "and {{rotation:03.1}} digits after the point too",
                            in_quotes(text_), shortened(inside)));
        }
        part.width = width.empty() ? 0 : std::stoul(width);
        if (has_precision) part.precision = std::stoi(digits);
    }
    parts_.push_back(part);
}

std::string Pattern::expand(const PatternValues& v) const {
    std::string out;
    for (const Part& part : parts_) {
        const std::string& f = part.field;
        if (f.empty()) out += part.literal;
        if (f == "map") out += v.map;
        if (f == "folder") out += v.folder;
        if (f == "rotation") out += padded(number(v.rotation, part.precision), part.width);
        if (f == "frame") out += of_whole(v.frame, part.width);
        if (f == "samples") out += of_whole(v.samples, part.width);
        if (f == "estimator") out += v.estimator;
        if (f == "sequence") out += v.sequence.empty() ? MISSING_VALUE : v.sequence;
        if (f == "seed") out += of_whole(v.seed, part.width);
        if (f == "size") out += of_whole(v.size, part.width);
    }
    return out;
}

}  // namespace clerestory
