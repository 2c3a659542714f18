#pragma once

#include "cl/device.hpp"

/// The device that tests run on: the first CPU of this machine, or what the environment asks for, so that the whole
/// suite can be run on another one (scripts/check_devices.sh), or down the path of another kind of device.
namespace clerestory::test {

/// `options`, and where they do not say: the device that CLERESTORY_TEST_DEVICE names (P:D), laid out for as what
/// CLERESTORY_TEST_ACT_AS says (accelerator).
DeviceOptions test_options(DeviceOptions options = {});

/// The flags by which the program is told the same; empty where the environment asks for nothing.
std::vector<std::string> test_flags();

/// So many compute units where the device can be used in part, else 0: all of it.
unsigned threads_where_possible(unsigned threads);

/// A Device of test_options.
class TestDevice : public Device {
  public:
    explicit TestDevice(const DeviceOptions& options = {}, const DeviceHooks& hooks = {})
        : Device(test_options(options), hooks) {}
};

}  // namespace clerestory::test
