#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "clerestory/export.hpp"

namespace clerestory {

/// What went wrong, said for the person at the command line; `exit_code` is what the program ends with. It is one line,
/// or one for each of `lines`: file names and what files hold may be anything, so control characters in them are shown
/// as escapes.
class CLERESTORY_API Error : public std::runtime_error {
  public:
    Error(int exit_code, const std::string& what);
    Error(int exit_code, const std::vector<std::string>& lines);
    [[nodiscard]] int exit_code() const noexcept { return exit_code_; }

  private:
    int exit_code_;
};

/// A comparison that failed, or some jobs of a batch.
struct CLERESTORY_API Mismatch : Error {
    explicit Mismatch(const std::string& what) : Error(1, what) {}
};

/// A flag or an argument that cannot be used.
struct CLERESTORY_API UsageError : Error {
    explicit UsageError(const std::string& what) : Error(2, what) {}
};

/// A map, an image or a job file that cannot be used.
struct CLERESTORY_API InputError : Error {
    explicit InputError(const std::string& what) : Error(3, what) {}
    explicit InputError(const std::vector<std::string>& lines) : Error(3, lines) {}
};

/// An OpenCL device or kernel that failed, or memory that the device does not have.
struct CLERESTORY_API DeviceError : Error {
    explicit DeviceError(const std::string& what) : Error(4, what) {}
    explicit DeviceError(const std::vector<std::string>& lines) : Error(4, lines) {}
};

/// An output that could not be written.
struct CLERESTORY_API OutputError : Error {
    explicit OutputError(const std::string& what) : Error(5, what) {}
};

}  // namespace clerestory
