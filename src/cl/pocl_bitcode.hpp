#pragma once

#include <optional>
#include <string>
#include <vector>

#include "cl/device.hpp"

namespace clerestory {

/// Whether the device is driven by PoCL.
bool is_pocl(const DeviceInfo& info);
/// Whether its compiler makes instructions of clang's own functions, and takes unlinked bitcode for a program: PoCL
/// from 3.1 on. 3.0 leaves calls of functions that nobody has.
bool has_clang_builtins(const DeviceInfo& info);

/// LLVM bitcode of a source, compiled and not linked, which PoCL takes as a program's binary; nothing where it fails.
///
/// It is what the program cache keeps on PoCL. Asked for the binary of a finished program, PoCL compiles every kernel
/// of it once more for work-groups of any size, which no launch here ever uses, and which takes longer than all the
/// rest of a first run. A compiled object's binary has no kernels, and PoCL keeps what it links from bitcode by the
/// bitcode's digest.
std::optional<std::vector<unsigned char>> compile_to_bitcode(const Device& device, const std::string& source,
                                                             const std::string& options);

/// The bitcode within a binary of PoCL's own format; nothing where there is none.
std::optional<std::vector<unsigned char>> bitcode_in(const std::vector<unsigned char>& binary);

}  // namespace clerestory
