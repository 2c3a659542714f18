#include "cl/device.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "cl/error_name.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

constexpr const char* NO_DEVICE_ADVICE =
    "install pocl-opencl-icd, or a driver of your GPU, and see `clerestory devices`";

/// Platforms of the loader; none is no error here.
std::vector<cl::Platform> platforms() {
    std::vector<cl::Platform> found;
    try {
        cl::Platform::get(&found);
    } catch (const cl::Error&) {
        found.clear();
    }
    return found;
}

std::vector<cl::Device> devices_of(const cl::Platform& platform) {
    std::vector<cl::Device> found;
    try {
        platform.getDevices(CL_DEVICE_TYPE_ALL, &found);
    } catch (const cl::Error&) {
        found.clear();
    }
    return found;
}

DeviceInfo describe(const cl::Platform& platform, const cl::Device& device, std::size_t p, std::size_t d) {
    DeviceInfo info;
    info.selector = fmt::format("{}:{}", p, d);
    info.platform = platform.getInfo<CL_PLATFORM_NAME>();
    info.version = platform.getInfo<CL_PLATFORM_VERSION>();
    info.name = device.getInfo<CL_DEVICE_NAME>();
    info.driver = device.getInfo<CL_DRIVER_VERSION>();
    info.is_cpu = (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU) != 0;
    info.has_fp64 = device.getInfo<CL_DEVICE_DOUBLE_FP_CONFIG>() != 0;
    info.has_compiler = device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>() != CL_FALSE;
    info.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
    info.max_work_group = device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>();
    info.memory_bytes = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
    info.max_allocation_bytes = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
    return info;
}

using Found = std::pair<cl::Device, DeviceInfo>;

std::vector<Found> find_devices() {
    std::vector<Found> found;
    const auto all = platforms();
    for (std::size_t p = 0; p < all.size(); ++p) {
        const auto devices = devices_of(all[p]);
        for (std::size_t d = 0; d < devices.size(); ++d) {
            found.emplace_back(devices[d], describe(all[p], devices[d], p, d));
        }
    }
    return found;
}

bool is_selector(const std::string& text) {
    const auto colon = text.find(':');
    if (colon == std::string::npos || colon == 0 || colon + 1 == text.size()) return false;
    return std::count(text.begin(), text.end(), ':') == 1 &&
           std::all_of(text.begin(), text.end(), [](char c) { return c == ':' || (c >= '0' && c <= '9'); });
}

Found choose(const std::string& selector) {
    auto found = find_devices();
    if (!selector.empty() && !is_selector(selector)) {
        throw UsageError(fmt::format(
            "--device {}: not a platform and a device by number, such as 0:0; see `clerestory devices`", selector));
    }
    if (found.empty()) throw DeviceError(fmt::format("no OpenCL device on this machine: {}", NO_DEVICE_ADVICE));
    const auto wanted = std::find_if(found.begin(), found.end(), [&](const Found& f) {
        return selector.empty() ? f.second.is_cpu : f.second.selector == selector;
    });
    if (wanted != found.end()) return *wanted;
    if (selector.empty()) return found.front();
    throw DeviceError(fmt::format("no OpenCL device {}: {} found; see `clerestory devices`", selector, found.size()));
}

cl::Device part_of(const cl::Device& device, unsigned threads, unsigned compute_units) {
    if (threads == 0 || threads >= compute_units) return device;
    const std::array<cl_device_partition_property, 4> counts = {CL_DEVICE_PARTITION_BY_COUNTS,
                                                                static_cast<cl_device_partition_property>(threads),
                                                                CL_DEVICE_PARTITION_BY_COUNTS_LIST_END, 0};
    std::vector<cl::Device> parts;
    cl::Device whole = device;
    whole.createSubDevices(counts.data(), &parts);
    // PoCL 3.1's threads look at the device of an event that has ended already; were it freed by then, they would
    // crash. A reference that nobody gives back keeps the sub-device, as the whole device is kept, to the end of the
    // process.
    clRetainDevice(parts.at(0)());
    return parts.at(0);
}

}  // namespace

std::vector<DeviceInfo> list_devices() {
    std::vector<DeviceInfo> infos;
    for (auto& found : find_devices()) infos.push_back(std::move(found.second));
    return infos;
}

DeviceInfo chosen_device(const DeviceOptions& options) { return choose(options.selector).second; }

Device::Device(const DeviceOptions& options)
    : work_group_(options.work_group), program_cache_(options.program_cache), kernel_log_(options.kernel_log) {
    if (!options.precompile_into.empty()) precompilation_ = std::make_shared<Precompilation>(options.precompile_into);
    try {
        std::tie(device_, info_) = choose(options.selector);
        if (!info_.has_compiler) {
            throw DeviceError(fmt::format("device {} ({}) cannot compile kernels: choose another with --device",
                                          info_.selector, info_.name));
        }
        device_ = part_of(device_, options.threads, info_.compute_units);
        info_.compute_units = device_.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
        context_ = cl::Context(device_);
        traits_ = traits_of(device_, info_, options.act_as);
        queue_ = cl::CommandQueue(context_, device_, cl::QueueProperties::Profiling);
    } catch (const cl::Error& error) {
        throw DeviceError(fmt::format("opening the OpenCL device failed in {}: {}; {}", error.what(),
                                      error_name(error.err()), NO_DEVICE_ADVICE));
    }
}

std::size_t Device::work_group(std::size_t preferred) const noexcept {
    const std::size_t wanted = work_group_ != 0 ? work_group_ : preferred;
    return std::clamp<std::size_t>(wanted, 1, info_.max_work_group);
}

void Device::finish() const {
    try {
        queue_.finish();
    } catch (const cl::Error& error) {
        throw DeviceError(
            fmt::format("the OpenCL device {} failed while running: {}", info_.name, error_name(error.err())));
    }
}

}  // namespace clerestory
