#include "cl/buffer.hpp"

#include <cstdlib>
#include <memory>
#include <new>

#include "base/huge_pages.hpp"

namespace clerestory::detail {
namespace {

using Memory = std::unique_ptr<void, decltype(&std::free)>;

Memory pages_for(std::size_t bytes) {
    try {
        return {take_pages(bytes), std::free};
    } catch (const std::bad_alloc&) {
        throw cl::Error(CL_MEM_OBJECT_ALLOCATION_FAILURE, "taking memory");
    }
}

void CL_CALLBACK give_back(cl_mem /*gone*/, void* memory) { std::free(memory); }

}  // namespace

cl::Buffer take_buffer(const Device& device, std::size_t bytes) {
    if (!device.traits().zero_copy || !worth_huge_pages(bytes)) return {device.context(), CL_MEM_READ_WRITE, bytes};
    Memory memory = pages_for(bytes);
    cl::Buffer buffer(device.context(), CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, bytes, memory.get());
    // The last command that uses the buffer may outlive its owner, so the driver says when the memory is free.
    buffer.setDestructorCallback(give_back, memory.get());
    static_cast<void>(memory.release());
    return buffer;
}

}  // namespace clerestory::detail
