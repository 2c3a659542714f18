#pragma once

#include <string_view>

namespace clerestory {

/// Opens descriptors 0 to 2 where the caller has closed them: else the first file that is opened gets one of their
/// numbers, and messages are written into a picture. Reading or writing there fails, as it does on what is closed. For
/// a program's first lines.
void open_standard_streams() noexcept;

/// Writes to stderr as far as that can be written: no message is worth the work that it speaks of. Neither a full disk
/// nor a pipe that nobody reads ends the program.
void print_to_stderr(std::string_view text) noexcept;

}  // namespace clerestory
