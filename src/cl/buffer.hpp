#pragma once

#include <fmt/format.h>
#include <CL/opencl.hpp>

#include <cstddef>
#include <span>
#include <vector>

#include "cl/device.hpp"
#include "cl/error_name.hpp"
#include "error.hpp"

namespace clerestory {
namespace detail {

/// Memory on the device, of huge pages where a CPU's would be many. Throws cl::Error.
cl::Buffer take_buffer(const Device& device, std::size_t bytes);

}  // namespace detail

/// An array on the device: movable, not copyable. Throws DeviceError naming the array and its size.
template <class T>
class Buffer {
  public:
    Buffer() = default;
    Buffer(const Buffer&) = delete;
    Buffer& operator=(const Buffer&) = delete;
    Buffer(Buffer&&) noexcept = default;
    Buffer& operator=(Buffer&&) noexcept = default;
    ~Buffer() = default;

    /// `count` elements, not initialised; `name` is for messages. OpenCL has no empty buffer, so one element is least.
    Buffer(const Device& device, const char* name, std::size_t count)
        : queue_(device.queue()), name_(name), count_(count) {
        const std::size_t bytes = std::max<std::size_t>(count, 1) * sizeof(T);
        if (bytes > device.info().max_allocation_bytes) {
            throw DeviceError(
                fmt::format("{}: {} bytes are more than device {} gives to one buffer ({}); choose another "
                            "with --device, or a smaller map",
                            name, bytes, device.info().name, device.info().max_allocation_bytes));
        }
        guarded("allocating", [&] { buffer_ = detail::take_buffer(device, bytes); });
    }

    /// A copy of `values`.
    Buffer(const Device& device, const char* name, std::span<const T> values) : Buffer(device, name, values.size()) {
        upload(values);
    }

    /// Page-aligned host memory that outlives the buffer: used where it lies if the device can, copied elsewhere.
    static Buffer over(const Device& device, const char* name, std::span<const T> values) {
        if (!device.traits().zero_copy || values.empty()) return Buffer(device, name, values);
        Buffer view;
        view.queue_ = device.queue();
        view.name_ = name;
        view.count_ = values.size();
        // OpenCL takes a plain pointer for memory that it will only read.
        view.guarded("wrapping", [&] {
            view.buffer_ = cl::Buffer(device.context(), CL_MEM_READ_ONLY | CL_MEM_USE_HOST_PTR, values.size_bytes(),
                                      const_cast<T*>(values.data()));
        });
        return view;
    }

    void upload(std::span<const T> values, std::size_t first = 0) {
        check_range("writing", first, values.size());
        if (values.empty()) return;
        guarded("writing", [&] {
            queue_.enqueueWriteBuffer(buffer_, CL_TRUE, first * sizeof(T), values.size_bytes(), values.data());
        });
    }

    void download(std::span<T> values, std::size_t first = 0) const {
        check_range("reading", first, values.size());
        if (values.empty()) return;
        guarded("reading", [&] {
            queue_.enqueueReadBuffer(buffer_, CL_TRUE, first * sizeof(T), values.size_bytes(), values.data());
        });
    }

    [[nodiscard]] std::vector<T> download() const {
        std::vector<T> values(count_);
        download(values);
        return values;
    }

    void fill(T value) {
        if (count_ == 0) return;
        guarded("filling", [&] { queue_.enqueueFillBuffer(buffer_, value, 0, count_ * sizeof(T)); });
    }

    [[nodiscard]] std::size_t size() const noexcept { return count_; }
    [[nodiscard]] std::size_t bytes() const noexcept { return count_ * sizeof(T); }
    [[nodiscard]] const cl::Buffer& handle() const noexcept { return buffer_; }

  private:
    void check_range(const char* doing, std::size_t first, std::size_t count) const {
        if (first > count_ || count > count_ - first) {
            throw DeviceError(
                fmt::format("{} {}: elements {} to {} of {}", doing, name_, first, first + count, count_));
        }
    }

    template <class F>
    void guarded(const char* doing, F&& action) const {
        try {
            action();
        } catch (const cl::Error& error) {
            throw DeviceError(
                fmt::format("{} {} ({} bytes) failed: {}", doing, name_, bytes(), error_name(error.err())));
        }
    }

    cl::CommandQueue queue_;
    const char* name_ = "";
    std::size_t count_ = 0;
    cl::Buffer buffer_;
};

using Floats = Buffer<cl_float>;
using Uints = Buffer<cl_uint>;

}  // namespace clerestory
