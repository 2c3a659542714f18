#pragma once

#include <CL/opencl.hpp>

#include <cstddef>

#include "clerestory/device.hpp"

namespace clerestory {

/// The widest register that a kernel names: arrays that are read by registers are padded to a multiple of it.
inline constexpr std::size_t WIDEST_SIMD = 16;

/// How work is laid out for a device: decided once, when it is opened, and nowhere else.
struct DeviceTraits {
    /// A work-item is worth a core: it takes a whole row, or a block of samples or pixels, in loops that the compiler
    /// vectorises. Otherwise work-items run in lock step: each takes one element, and neighbours read neighbours.
    bool fat_items = false;
    std::size_t simd_width = 1;     ///< values side by side in a register that a kernel names itself: PIXELS_WIDE
    std::size_t thin_group = 64;    ///< work-items of a group that take an element each
    std::size_t fat_group = 64;     ///< work-items of a group that take a row or a block each, where items are fat
    std::size_t some_group = 64;    ///< work-items of a group that take a few registers each
    std::size_t scan_lanes = 256;   ///< work-items that scan a chunk of a row together, where items are not fat
    bool zero_copy = false;         ///< kernels read the host's memory where it lies
    bool fp64 = false;              ///< double precision
    bool denormals = false;         ///< numbers below 2^-126 are kept; else they may count as 0
    bool clang_builtins = false;    ///< clang's own functions become instructions: kernels/inline.clh
    bool streaming_stores = false;  ///< stores past the caches pay
    std::size_t local_bytes = 0;    ///< local memory of a group
};

/// The traits of `device`, or those of another kind of device that it is to be treated as.
DeviceTraits traits_of(const cl::Device& device, const DeviceInfo& info, ActAs act_as);

}  // namespace clerestory
