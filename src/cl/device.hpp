#pragma once

#include <CL/opencl.hpp>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#include "cl/device_traits.hpp"
#include "cl/kernel_log.hpp"
#include "cl/precompiled.hpp"
#include "cl/program_cache.hpp"
#include "clerestory/device.hpp"

namespace clerestory {

/// A one-dimensional range: `count` work-items, padded up to whole groups of `group`; kernels ignore the padding.
struct Range {
    std::size_t count = 0;
    std::size_t group = 1;
    [[nodiscard]] std::size_t padded() const noexcept { return (count + group - 1) / group * group; }
};

/// What may look on while a device works; empty: nothing does.
struct DeviceHooks {
    std::filesystem::path precompile_into = {};  ///< takes programs with the kernels that ran, for an installation
    std::shared_ptr<KernelLog> kernel_log = {};  ///< takes every launch, for benchmarks
};

/// An open device: context, in-order queue, and how work is laid out for it. Throws DeviceError, UsageError for a bad
/// selector.
class Device {
  public:
    explicit Device(const DeviceOptions& options = {}, const DeviceHooks& hooks = {});

    [[nodiscard]] const DeviceInfo& info() const noexcept { return info_; }
    [[nodiscard]] const DeviceTraits& traits() const noexcept { return traits_; }
    [[nodiscard]] const cl::Context& context() const noexcept { return context_; }
    [[nodiscard]] const cl::CommandQueue& queue() const noexcept { return queue_; }
    [[nodiscard]] const cl::Device& handle() const noexcept { return device_; }

    /// Of work-items that take an element each.
    [[nodiscard]] Range thin(std::size_t count) const noexcept { return {count, work_group(traits_.thin_group)}; }
    /// Of work-items that take a row or a block each.
    [[nodiscard]] Range fat(std::size_t count) const noexcept { return {count, work_group(traits_.fat_group)}; }
    /// Of work-items that take a few registers each.
    [[nodiscard]] Range some(std::size_t count) const noexcept { return {count, work_group(traits_.some_group)}; }
    /// Of one work-item, for what can only be done one after the other.
    [[nodiscard]] Range single() const noexcept { return {1, traits_.fat_group}; }
    /// Of groups of traits().scan_lanes work-items that work together, whatever was asked for.
    [[nodiscard]] Range scanning(std::size_t groups) const noexcept {
        return {groups * traits_.scan_lanes, traits_.scan_lanes};
    }
    /// Work-items in a group: as many as were asked for, else `preferred`, within the device's limit.
    [[nodiscard]] std::size_t work_group(std::size_t preferred) const noexcept;
    /// Whether a size was asked for, so that none may be put in its place in silence.
    [[nodiscard]] bool work_group_asked() const noexcept { return work_group_ != 0; }

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
    DeviceTraits traits_;
    std::size_t work_group_ = 0;
    ProgramCache program_cache_;
    std::shared_ptr<Precompilation> precompilation_;
    std::shared_ptr<KernelLog> kernel_log_;
};

}  // namespace clerestory
