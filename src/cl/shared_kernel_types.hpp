#pragma once

#include "cl/kernel.hpp"
#include "shared_types.h"

namespace clerestory {

template <>
struct KernelType<Census> {
    static constexpr const char* name = "Census";
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
struct KernelType<RowFrame> {
    static constexpr const char* name = "RowFrame";
};

}  // namespace clerestory
