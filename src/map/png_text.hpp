#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace clerestory {

/// Keys and values of a PNG file's tEXt chunks, Latin-1; a key has 1 to 79 characters.
using PngText = std::map<std::string, std::string>;

/// 8-bit PNG of `channels` 3 or 4, as write_png writes it; `file` is only named in messages. Throws OutputError.
std::vector<char> png_bytes(const std::filesystem::path& file, std::size_t width, std::size_t height,
                            std::size_t channels, const unsigned char* pixels, const PngText& text = {});

/// write_png with `text` in the file.
void write_png(const std::filesystem::path& file, std::size_t width, std::size_t height, std::size_t channels,
               const unsigned char* pixels, const PngText& text);

/// The tEXt chunks before the pixels of a PNG file that ends as it should; nothing of any other file. Never throws for
/// what a file holds.
PngText read_png_text(const std::filesystem::path& file);

}  // namespace clerestory
