#pragma once

#include <CL/opencl.hpp>

#include <string>
#include <string_view>

#include "cl/device.hpp"

namespace clerestory {

/// A built program of kernels/. Throws DeviceError with the compiler's own words and the kernel file's own lines.
class Program {
  public:
    /// `file` is a name in kernels/, such as "stage2_cdf.cl"; `defines` goes to the compiler as it is.
    Program(const Device& device, std::string_view file, const std::string& defines = "");

    [[nodiscard]] const cl::Program& handle() const noexcept { return program_; }
    [[nodiscard]] const std::string& file() const noexcept { return file_; }

  private:
    std::string file_;
    cl::Program program_;
};

/// The options that a program with these defines is built with on `device`.
std::string build_options(const Device& device, const std::string& defines);

/// All that decides what a program of `source` does on `device`: what caches know it by.
std::string program_key(const Device& device, const std::string& source, const std::string& defines);

/// The source of `file` with its includes in place, each piece led by a #line of its own file.
std::string assembled_source(std::string_view file);

}  // namespace clerestory
