#pragma once

#include <CL/opencl.hpp>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "cl/kernel_log.hpp"
#include "cl/program_cache.hpp"

namespace clerestory {

/// Which device to open and how much of it to use.
struct DeviceOptions {
    std::string selector;        ///< "P:D", platform and device by number; empty: the first CPU, else the first device
    unsigned threads = 0;        ///< compute units to use, by a sub-device; 0: all
    std::size_t work_group = 0;  ///< work-items in a group; 0: each kernel's own choice
    std::filesystem::path program_cache = {};    ///< folder that keeps built programs; empty: none
    std::shared_ptr<KernelLog> kernel_log = {};  ///< takes every launch; empty: nothing does
};

/// What a device is and can do.
struct DeviceInfo {
    std::string selector;  ///< "P:D"
    std::string platform;
    std::string name;
    std::string version;  ///< the platform's version text, in which PoCL names its own
    std::string driver;
    bool is_cpu = false;
    bool has_fp64 = false;
    bool has_compiler = false;
    unsigned compute_units = 0;
    std::size_t max_work_group = 0;
    std::size_t memory_bytes = 0;
    std::size_t max_allocation_bytes = 0;
};

/// Every OpenCL device of this machine; empty where there is none.
std::vector<DeviceInfo> list_devices();

/// An open device: context, in-order queue, and the sizes of work-groups. Throws DeviceError, UsageError for a bad
/// selector.
class Device {
  public:
    explicit Device(const DeviceOptions& options = {});

    [[nodiscard]] const DeviceInfo& info() const noexcept { return info_; }
    [[nodiscard]] const cl::Context& context() const noexcept { return context_; }
    [[nodiscard]] const cl::CommandQueue& queue() const noexcept { return queue_; }
    [[nodiscard]] const cl::Device& handle() const noexcept { return device_; }

    /// Work-items in a group: the one asked for at the command line, else `preferred`, within the device's limit.
    [[nodiscard]] std::size_t work_group(std::size_t preferred) const noexcept;

    [[nodiscard]] const ProgramCache& program_cache() const noexcept { return program_cache_; }
    [[nodiscard]] const std::shared_ptr<KernelLog>& kernel_log() const noexcept { return kernel_log_; }

    void finish() const;

  private:
    cl::Device device_;
    cl::Context context_;
    cl::CommandQueue queue_;
    DeviceInfo info_;
    std::size_t work_group_ = 0;
    ProgramCache program_cache_;
    std::shared_ptr<KernelLog> kernel_log_;
};

}  // namespace clerestory
