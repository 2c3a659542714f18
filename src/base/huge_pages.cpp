#include "base/huge_pages.hpp"

#include <sys/mman.h>

#include <cstdlib>
#include <new>

namespace clerestory {

void* take_pages(std::size_t bytes) {
    const bool huge = worth_huge_pages(bytes);
    const std::size_t page = huge ? HUGE_PAGE : PAGE;
    const std::size_t whole = (bytes + page - 1) / page * page;
    void* memory = std::aligned_alloc(page, whole);
    if (memory == nullptr) throw std::bad_alloc();
    if (huge) madvise(memory, whole, MADV_HUGEPAGE);  // a hint: it may fail, and nothing depends on it
    return memory;
}

}  // namespace clerestory
