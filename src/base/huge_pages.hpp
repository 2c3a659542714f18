#pragma once

#include <cstddef>

namespace clerestory {

/// What a page and a huge page hold on the processors that matter, bytes.
inline constexpr std::size_t PAGE = 4096;
inline constexpr std::size_t HUGE_PAGE = std::size_t{1} << 21;

/// Whether so much memory is worth huge pages: its first touch, which is what taking memory costs, is several times
/// cheaper with them, and so are random reads of tables that no cache holds.
constexpr bool worth_huge_pages(std::size_t bytes) { return bytes >= 2 * HUGE_PAGE; }

/// Memory of whole pages, huge ones where that is worth it, not initialised; to be given back to std::free. Throws
/// std::bad_alloc.
void* take_pages(std::size_t bytes);

}  // namespace clerestory
