#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "clerestory/export.hpp"

namespace clerestory {

/// What kind of device work is laid out for.
enum class ActAs {
    itself,
    accelerator,           ///< one whose work-items run in lock step, whatever it is: for tests of that path
    flushing_accelerator,  ///< the same, and numbers below 2^-126 may count as 0
};

/// By its name at the command line: accelerator, flushing-accelerator. Throws UsageError.
CLERESTORY_API ActAs act_as_by_name(const std::string& name);
/// The name of one that is not `itself`.
CLERESTORY_API std::string act_as_name(ActAs act_as);

/// Which device to open and how much of it to use.
struct DeviceOptions {
    std::string selector = {};   ///< "P:D", platform and device by number; empty: the first CPU, else the first device
    unsigned threads = 0;        ///< compute units to use, by a sub-device; 0: all
    std::size_t work_group = 0;  ///< work-items in a group; 0: each kernel's own choice
    ActAs act_as = ActAs::itself;
    std::filesystem::path program_cache = {};  ///< folder that keeps built programs; empty: none
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
    std::string trouble;  ///< why it cannot be used, where its driver does not even say what it is; empty: it can
};

/// Every OpenCL device of this machine, those in trouble included; empty where there is none.
CLERESTORY_API std::vector<DeviceInfo> list_devices();

/// The device that these options choose, without opening it. Throws DeviceError where there is none, UsageError for a
/// bad selector.
CLERESTORY_API DeviceInfo chosen_device(const DeviceOptions& options = {});

}  // namespace clerestory
