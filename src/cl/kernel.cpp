#include "cl/kernel.hpp"

namespace clerestory::detail {
namespace {

/// Drivers differ in how they spell a type ("uint" or "unsigned int", "float *" or "float*"); one spelling here.
std::string plain(std::string name) {
    name.resize(name.find_last_not_of('\0') + 1);  // some drivers count the end mark
    std::string out;
    for (const char c : name) {
        if (c != ' ') out += c;
    }
    for (const auto& [from, to] :
         {std::pair{"unsignedint", "uint"}, {"unsignedlong", "ulong"}, {"unsignedchar", "uchar"}}) {
        const auto at = out.find(from);
        if (at != std::string::npos) out.replace(at, std::string_view(from).size(), to);
    }
    return out;
}

}  // namespace

void check_arguments(const cl::Kernel& kernel, const std::string& label, const std::string* names, std::size_t count) {
    const auto own_count = kernel.getInfo<CL_KERNEL_NUM_ARGS>();
    if (own_count != count) {
        throw DeviceError(fmt::format("{} takes {} arguments, not {}", label, own_count, count));
    }
    for (std::size_t i = 0; i < count; ++i) {
        std::string own;
        try {
            own = plain(kernel.getArgInfo<CL_KERNEL_ARG_TYPE_NAME>(static_cast<cl_uint>(i)));
        } catch (const cl::Error&) {
            return;  // a driver may keep no argument info; then there is nothing to compare with
        }
        if (own != names[i]) {
            throw DeviceError(fmt::format("{}: argument {} is {} there and {} here", label, i, own, names[i]));
        }
    }
}

}  // namespace clerestory::detail
