#include "cl/device.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <tuple>
#include <utility>

#include "cl/error_name.hpp"
#include "cl/pocl_bitcode.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

constexpr const char* NO_DEVICE_ADVICE =
    "install pocl-opencl-icd, or a driver of your GPU, and see `clerestory devices`";

// PoCL's threads have the stack that the process's limit says, and a work-group's private arrays lie on it: 14 KB for
// each work-item of draw_blocks. The driver allows groups that end in a signal.
constexpr std::size_t STACK_PER_ITEM = std::size_t{32} << 10;
constexpr std::size_t LARGEST_POCL_GROUP = 256;

std::size_t largest_group(const DeviceInfo& info) {
    if (!is_pocl(info)) return info.max_work_group;
    rlimit stack{};
    const bool bounded = getrlimit(RLIMIT_STACK, &stack) == 0 && stack.rlim_cur != RLIM_INFINITY;
    const std::size_t fitting =
        bounded ? static_cast<std::size_t>(stack.rlim_cur) / STACK_PER_ITEM : LARGEST_POCL_GROUP;
    return std::clamp<std::size_t>(fitting, 1, std::min(LARGEST_POCL_GROUP, info.max_work_group));
}

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

/// What is known of a platform by its own words, which a broken driver may not have.
DeviceInfo describe(const cl::Platform& platform) {
    DeviceInfo info;
    try {
        info.platform = platform.getInfo<CL_PLATFORM_NAME>();
        info.version = platform.getInfo<CL_PLATFORM_VERSION>();
    } catch (const cl::Error& error) {
        info.platform = "a driver without a name";
        info.trouble = fmt::format("{} failed: {}", error.what(), error_name(error.err()));
    }
    return info;
}

void describe(const cl::Device& device, DeviceInfo& info) {
    info.name = device.getInfo<CL_DEVICE_NAME>();
    info.driver = device.getInfo<CL_DRIVER_VERSION>();
    info.is_cpu = (device.getInfo<CL_DEVICE_TYPE>() & CL_DEVICE_TYPE_CPU) != 0;
    info.has_fp64 = device.getInfo<CL_DEVICE_DOUBLE_FP_CONFIG>() != 0;
    info.has_compiler = device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>() != CL_FALSE;
    info.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
    info.max_work_group = device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>();
    info.memory_bytes = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
    info.max_allocation_bytes = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
}

using Found = std::pair<cl::Device, DeviceInfo>;

/// The devices of a platform, as `about` describes it. One driver in trouble takes no other along: what is wrong with
/// it is told in place of its devices.
std::vector<Found> devices_of(const cl::Platform& platform, const DeviceInfo& about, std::size_t p) {
    std::vector<Found> found;
    std::vector<cl::Device> devices;
    try {
        platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
    } catch (const cl::Error& error) {
        if (error.err() == CL_DEVICE_NOT_FOUND && !is_pocl(about)) return {};  // a GPU's driver without a GPU
        found.emplace_back(cl::Device(), about);
        DeviceInfo& info = found.back().second;
        info.selector = fmt::format("{}:-", p);
        info.trouble = fmt::format("it gives no device: {}", error_name(error.err()));
        if (is_pocl(about)) info.trouble += "; PoCL has none where it cannot write to its cache: see POCL_CACHE_DIR";
    }
    for (std::size_t d = 0; d < devices.size(); ++d) {
        found.emplace_back(devices[d], about);
        DeviceInfo& info = found.back().second;
        info.selector = fmt::format("{}:{}", p, d);
        try {
            describe(devices[d], info);
        } catch (const cl::Error& error) {
            info.trouble = fmt::format("{} failed: {}", error.what(), error_name(error.err()));
        }
    }
    return found;
}

std::vector<Found> find_devices() {
    std::vector<Found> found;
    const auto all = platforms();
    for (std::size_t p = 0; p < all.size(); ++p) {
        auto devices = devices_of(all[p], describe(all[p]), p);
        std::move(devices.begin(), devices.end(), std::back_inserter(found));
    }
    return found;
}

/// What is wrong with all that was found, for a message.
std::string troubles_of(const std::vector<Found>& found) {
    std::string text;
    for (const auto& [device, info] : found) {
        if (!info.trouble.empty())
            text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", info.platform, info.trouble);
    }
    return text;
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
    const auto sound = [](const Found& f) { return f.second.trouble.empty(); };
    auto wanted = std::find_if(found.begin(), found.end(), [&](const Found& f) {
        return selector.empty() ? sound(f) && f.second.is_cpu : f.second.selector == selector;
    });
    if (wanted == found.end() && selector.empty()) wanted = std::find_if(found.begin(), found.end(), sound);
    if (wanted == found.end() && selector.empty()) {
        throw DeviceError(fmt::format("no OpenCL device that works on this machine: {}", troubles_of(found)));
    }
    if (wanted == found.end()) {
        throw DeviceError(
            fmt::format("no OpenCL device {}: {} found; see `clerestory devices`", selector, found.size()));
    }
    if (!sound(*wanted)) {
        throw DeviceError(
            fmt::format("OpenCL device {} ({}): {}", selector, wanted->second.platform, wanted->second.trouble));
    }
    return *wanted;
}

cl::Device part_of(const cl::Device& device, unsigned threads, unsigned compute_units) {
    if (threads == 0 || threads >= compute_units) return device;
    const auto ways = device.getInfo<CL_DEVICE_PARTITION_PROPERTIES>();
    if (std::find(ways.begin(), ways.end(), CL_DEVICE_PARTITION_BY_COUNTS) == ways.end()) {
        throw DeviceError(
            fmt::format("--threads {}: device {} cannot be used in part; leave --threads out to use all of it", threads,
                        device.getInfo<CL_DEVICE_NAME>()));
    }
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

Device::Device(const DeviceOptions& options, const DeviceHooks& hooks)
    : work_group_(options.work_group), program_cache_(options.program_cache), kernel_log_(hooks.kernel_log) {
    if (!hooks.precompile_into.empty()) precompilation_ = std::make_shared<Precompilation>(hooks.precompile_into);
    try {
        std::tie(device_, info_) = choose(options.selector);
        if (!info_.has_compiler) {
            throw DeviceError(fmt::format("device {} ({}) cannot compile kernels: choose another with --device",
                                          info_.selector, info_.name));
        }
        info_.max_work_group = largest_group(info_);
        if (work_group_ > info_.max_work_group) {
            throw UsageError(fmt::format("--work-group {}: on device {} a group has at most {} work-items", work_group_,
                                         info_.name, info_.max_work_group));
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
