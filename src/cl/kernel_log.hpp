#pragma once

#include <CL/opencl.hpp>

#include <memory>
#include <string>
#include <vector>

namespace clerestory {

/// A launch of a kernel; its event tells when it ran.
struct KernelRun {
    std::string kernel;
    cl::Event event;
};

/// Launches in their order, for those who measure them. One thread at a time.
using KernelLog = std::vector<KernelRun>;

}  // namespace clerestory
