/* Preloaded before oclgrind 21.10, which takes for uninitialised what it should not:
   what is written to a buffer that stands where a released one stood, so buffers live to the end here;
   what was filled, so fills are writes here;
   and host memory that a buffer wraps, so such a buffer (always read-only) is a copy here. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int clEnqueueWriteBuffer(void* queue, void* buffer, unsigned blocking, size_t offset, size_t size, const void* from,
                         unsigned events, const void* wait_for, void* event);

int clReleaseMemObject(void* buffer) {
    const int invalid_mem_object = -38;
    return buffer ? 0 : invalid_mem_object;
}

int clEnqueueFillBuffer(void* queue, void* buffer, const void* pattern, size_t pattern_size, size_t offset, size_t size,
                        unsigned events, const void* wait_for, void* event) {
    const int out_of_host_memory = -6;
    char* bytes = malloc(size);
    if (!bytes) return out_of_host_memory;
    for (size_t at = 0; at + pattern_size <= size; at += pattern_size) memcpy(bytes + at, pattern, pattern_size);
    const int status = clEnqueueWriteBuffer(queue, buffer, 1, offset, size, bytes, events, wait_for, event);
    free(bytes);
    return status;
}

void* clCreateBuffer(void* context, uint64_t flags, size_t size, void* host, int* status) {
    const uint64_t use_host_pointer = 1u << 3;
    const uint64_t copy_host_pointer = 1u << 5;
    void* (*create)(void*, uint64_t, size_t, void*, int*);
    *(void**)&create = dlsym(RTLD_NEXT, "clCreateBuffer");
    if (flags & use_host_pointer) flags ^= use_host_pointer | copy_host_pointer;
    return create(context, flags, size, host, status);
}
