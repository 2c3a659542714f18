#include "cl/device_traits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "base/named_values.hpp"
#include "cl/pocl_bitcode.hpp"

namespace clerestory {
namespace {

// OpenCL C asks for no more than this of any device with 16 KiB and more of local memory.
constexpr std::size_t MOST_SCAN_LANES = 256;

const NamedValues<ActAs>& kinds() {
    static const NamedValues<ActAs> all(
        "kind of device", {{ActAs::accelerator, "accelerator"}, {ActAs::flushing_accelerator, "flushing-accelerator"}});
    return all;
}

}  // namespace

std::string act_as_name(ActAs act_as) { return kinds().name_of(act_as); }
ActAs act_as_by_name(const std::string& name) { return kinds().by_name(name); }

DeviceTraits traits_of(const cl::Device& device, const DeviceInfo& info, ActAs act_as) {
    const bool as_cpu = info.is_cpu && act_as == ActAs::itself;
    DeviceTraits traits;
    traits.fat_items = as_cpu;
    traits.simd_width = as_cpu ? WIDEST_SIMD : 1;
    traits.fat_group = as_cpu ? 1 : traits.thin_group;
    traits.some_group = as_cpu ? 4 : traits.thin_group;
    traits.scan_lanes = std::bit_floor(std::min(MOST_SCAN_LANES, info.max_work_group));
    traits.zero_copy = as_cpu;
    traits.fp64 = info.has_fp64;
    traits.denormals =
        act_as != ActAs::flushing_accelerator && (device.getInfo<CL_DEVICE_SINGLE_FP_CONFIG>() & CL_FP_DENORM) != 0;
    traits.clang_builtins = as_cpu && has_clang_builtins(info);
    traits.streaming_stores = traits.clang_builtins;
    traits.local_bytes = device.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>();
    return traits;
}

}  // namespace clerestory
