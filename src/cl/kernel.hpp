#pragma once

#include <fmt/format.h>
#include <CL/opencl.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <type_traits>

#include "cl/buffer.hpp"
#include "cl/device.hpp"
#include "cl/program.hpp"

namespace clerestory {

/// A count as a kernel takes it; sizes are held below 2^32 before.
inline cl_uint narrow(std::size_t value) { return static_cast<cl_uint>(value); }

/// The OpenCL C name of a C++ argument type; specialise it for a struct of shared_types.h.
template <class T>
struct KernelType;
template <>
struct KernelType<cl_float> {
    static constexpr const char* name = "float";
};
template <>
struct KernelType<cl_float16> {
    static constexpr const char* name = "float16";
};
template <>
struct KernelType<cl_double> {
    static constexpr const char* name = "double";
};
template <>
struct KernelType<cl_int> {
    static constexpr const char* name = "int";
};
template <>
struct KernelType<cl_uint> {
    static constexpr const char* name = "uint";
};
template <>
struct KernelType<cl_ulong> {
    static constexpr const char* name = "ulong";
};
template <>
struct KernelType<cl_uchar> {
    static constexpr const char* name = "uchar";
};

/// Work space of each group, in the device's local memory: `count` elements.
template <class T>
struct LocalArray {
    std::size_t count = 0;
};

namespace detail {

template <class T>
struct Argument {
    static std::string name() { return KernelType<T>::name; }
    static void set(cl::Kernel& kernel, cl_uint index, const T& value) { kernel.setArg(index, value); }
};
template <class T>
struct Argument<Buffer<T>> {
    static std::string name() { return std::string(KernelType<std::remove_const_t<T>>::name) + "*"; }
    static void set(cl::Kernel& kernel, cl_uint index, const Buffer<T>& buffer) {
        kernel.setArg(index, buffer.handle());
    }
};
template <class T>
struct Argument<LocalArray<T>> {
    static std::string name() { return std::string(KernelType<T>::name) + "*"; }
    static void set(cl::Kernel& kernel, cl_uint index, const LocalArray<T>& array) {
        kernel.setArg(index, cl::Local(std::max<std::size_t>(array.count, 1) * sizeof(T)));
    }
};

/// Compares the kernel's own argument types with the C++ ones. Throws DeviceError.
void check_arguments(const cl::Kernel& kernel, const std::string& label, const std::string* names, std::size_t count);

}  // namespace detail

/// A kernel whose arguments are checked by type when it is made: a float passed for a uint is otherwise accepted in
/// silence. `Args` are scalars, Buffer<T> or LocalArray<T>.
template <class... Args>
class Kernel {
  public:
    Kernel(const Device& device, const Program& program, const char* name)
        : queue_(device.queue()),
          name_(name),
          label_(fmt::format("kernel {} of kernels/{}", name, program.file())),
          log_(device.kernel_log()) {
        guarded([&] { kernel_ = cl::Kernel(program.handle(), name); });
        const std::array<std::string, sizeof...(Args)> names = {detail::Argument<Args>::name()...};
        detail::check_arguments(kernel_, label_, names.data(), names.size());
        guarded([&] { largest_group_ = kernel_.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(device.handle()); });
        if (device.work_group_asked() && device.work_group(1) > largest_group_) {
            throw UsageError(fmt::format("--work-group {}: {} runs in groups of at most {} on this device",
                                         device.work_group(1), label_, largest_group_));
        }
    }

    /// Enqueues; returns the event of the run. Arguments are read before it returns.
    cl::Event operator()(Range range, const Args&... args) {
        cl::Event event;
        if (range.count == 0) return event;
        range.group = std::min(range.group, largest_group_);
        guarded([&] {
            cl_uint index = 0;
            (detail::Argument<Args>::set(kernel_, index++, args), ...);
            queue_.enqueueNDRangeKernel(kernel_, cl::NullRange, cl::NDRange(range.padded()), cl::NDRange(range.group),
                                        nullptr, &event);
        });
        if (log_) log_->push_back({name_, event});
        return event;
    }

  private:
    template <class F>
    void guarded(F&& action) const {
        try {
            action();
        } catch (const cl::Error& error) {
            throw DeviceError(fmt::format("{} failed in {}: {}", label_, error.what(), error_name(error.err())));
        }
    }

    cl::CommandQueue queue_;
    const char* name_;
    std::string label_;
    std::shared_ptr<KernelLog> log_;
    cl::Kernel kernel_;
    std::size_t largest_group_ = 1;
};

}  // namespace clerestory
