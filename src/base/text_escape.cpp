#include "base/text_escape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace clerestory {
namespace {

constexpr std::uint32_t SPACE = 0x20;
constexpr std::uint32_t DELETE = 0x7f;
constexpr std::uint32_t INVALID = 0xFFFFFFFF;

/// A character of UTF-8: its code point and length. A byte that belongs to none is INVALID, by itself.
struct Character {
    std::uint32_t code;
    std::size_t bytes;
};

/// Source: RFC 3629, section 4.
Character character_at(std::string_view text, std::size_t at) {
    constexpr std::uint32_t CONTINUATION_BITS = 6;
    constexpr std::uint32_t SMALLEST[] = {0, 0, 0x80, 0x800, 0x10000};  // of each length: none has two forms
    constexpr std::uint32_t LARGEST = 0x10FFFF;
    const auto byte = [&](std::size_t i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(text[i])); };
    const std::uint32_t first = byte(at);
    if (first < 0x80) return {first, 1};
    const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
    if (first < 0xC0 || first > 0xF7 || at + length > text.size()) return {INVALID, 1};
    std::uint32_t code = first & (0x7FU >> length);
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte(at + i) & 0xC0U) != 0x80U) return {INVALID, 1};
        code = code << CONTINUATION_BITS | (byte(at + i) & 0x3FU);
    }
    const bool is_surrogate = code >= 0xD800 && code <= 0xDFFF;
    if (code < SMALLEST[length] || code > LARGEST || is_surrogate) return {INVALID, 1};
    return {code, length};
}

/// Whether a terminal acts on a character beyond ASCII instead of showing it: the second set of controls, line ends,
/// and marks that reorder what stands around them.
bool is_obeyed(std::uint32_t code) {
    const auto within = [code](std::uint32_t first, std::uint32_t last) { return code >= first && code <= last; };
    return within(0x80, 0x9F) || within(0x2028, 0x202E) || within(0x2066, 0x2069) || within(0x200E, 0x200F);
}

/// A word with its controls and bytes beyond ASCII as numbers, as bash, zsh and ksh take it.
std::string ansi_c_word(std::string_view word) {
    std::string out = "$'";
    for (const char c : word) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < SPACE || byte >= DELETE) {
            out += fmt::format("\\{:03o}", byte);  // always three digits: none that follows can join them
        } else {
            if (c == '\'' || c == '\\') out += '\\';
            out += c;
        }
    }
    return out + "'";
}

}  // namespace

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
    if (one_line(word) != word) return ansi_c_word(word);
    std::string out = "'";
    for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
}

std::string shell_path(const std::filesystem::path& file) {
    return shell_word(file.native().starts_with('-') ? "./" + file.native() : file.native());
}

std::string one_line(std::string_view text) {
    std::string out;
    for (std::size_t at = 0; at < text.size();) {
        const Character character = character_at(text, at);
        const std::string_view bytes = text.substr(at, character.bytes);
        at += character.bytes;
        if (character.code == '\n') {
            out += "\\n";
        } else if (character.code == '\t') {
            out += "\\t";
        } else if (character.code == INVALID || character.code < SPACE || character.code == DELETE) {
            out += fmt::format("\\x{:02x}", static_cast<unsigned char>(bytes.front()));
        } else if (is_obeyed(character.code)) {
            out += fmt::format("\\u{:04x}", character.code);
        } else {
            out += bytes;
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
