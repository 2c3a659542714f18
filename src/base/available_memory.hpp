#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace clerestory {

/// Bytes that this process can still take: the kernel's MemAvailable, or what the process's memory control group (v1 or
/// v2, itself or a parent) leaves where that is less. The largest std::size_t where the machine says neither.
///   root  where /proc and /sys are found; tests give a folder of their own
std::size_t available_memory(const std::filesystem::path& root = "/");

/// A size for people: "812 B", "3.2 MB", "1.61 GB" (powers of ten).
std::string format_bytes(double bytes);

}  // namespace clerestory
