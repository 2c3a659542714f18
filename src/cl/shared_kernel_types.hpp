#pragma once

#include "cl/kernel.hpp"
#include "shared_types.h"

namespace clerestory {

template <>
struct KernelType<TexelCounts> {
    static constexpr const char* name = "TexelCounts";
};
template <>
struct KernelType<RowWeight> {
    static constexpr const char* name = "RowWeight";
};
template <>
struct KernelType<Strata> {
    static constexpr const char* name = "Strata";
};
template <>
struct KernelType<DrawSettings> {
    static constexpr const char* name = "DrawSettings";
};
template <>
struct KernelType<RowFrame> {
    static constexpr const char* name = "RowFrame";
};

}  // namespace clerestory
