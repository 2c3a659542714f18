#include "base/text_escape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace clerestory {

std::string escaped(std::string_view text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            default:
                out += c;
        }
    }
    return out;
}

std::string base64(std::string_view bytes) {
    constexpr std::string_view DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    constexpr std::size_t GROUP = 3;  // bytes that make four digits
    std::string out;
    out.reserve((bytes.size() + GROUP - 1) / GROUP * 4);
    for (std::size_t i = 0; i < bytes.size(); i += GROUP) {
        const std::size_t left = std::min(GROUP, bytes.size() - i);
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < GROUP; ++k) {
            bits = bits << 8 | (k < left ? static_cast<unsigned char>(bytes[i + k]) : 0U);
        }
        for (std::size_t k = 0; k < 4; ++k) out += k <= left ? DIGITS[bits >> (18 - 6 * k) & 63] : '=';
    }
    return out;
}

std::string png_uri(std::string_view png) { return "data:image/png;base64," + base64(png); }

std::string shell_word(std::string_view word) {
    constexpr std::string_view PLAIN = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=.,/:@%";
    if (!word.empty() && word.find_first_not_of(PLAIN) == std::string_view::npos) return std::string(word);
    std::string out = "'";
    for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
}

std::string one_line(std::string_view text) {
    constexpr unsigned char SPACE = 0x20;
    constexpr unsigned char DELETE = 0x7f;
    std::string out;
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (c == '\n') {
            out += "\\n";
        } else if (c == '\t') {
            out += "\\t";
        } else if (byte < SPACE || byte == DELETE) {
            out += fmt::format("\\x{:02x}", byte);
        } else {
            out += c;
        }
    }
    return out;
}

std::string suffix_of(const std::filesystem::path& file) {
    std::string suffix = file.extension().string();
    for (char& c : suffix) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return suffix;
}

}  // namespace clerestory
