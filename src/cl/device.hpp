#pragma once

#include <CL/opencl.hpp>

#include <cstddef>
#include <memory>

#include "cl/kernel_log.hpp"
#include "cl/precompiled.hpp"
#include "cl/program_cache.hpp"
#include "clerestory/device.hpp"

namespace clerestory {

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
    /// What takes this device's programs for an installation; empty where nothing does.
    [[nodiscard]] const std::shared_ptr<Precompilation>& precompilation() const noexcept { return precompilation_; }
    [[nodiscard]] const std::shared_ptr<KernelLog>& kernel_log() const noexcept { return kernel_log_; }

    void finish() const;

  private:
    cl::Device device_;
    cl::Context context_;
    cl::CommandQueue queue_;
    DeviceInfo info_;
    std::size_t work_group_ = 0;
    ProgramCache program_cache_;
    std::shared_ptr<Precompilation> precompilation_;
    std::shared_ptr<KernelLog> kernel_log_;
};

}  // namespace clerestory
