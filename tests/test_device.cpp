#include "test_device.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

namespace clerestory::test {
namespace {

std::string variable(const char* name) {
    const char* value = std::getenv(name);
    return value == nullptr ? "" : value;
}

const char* const DEVICE = "CLERESTORY_TEST_DEVICE";
const char* const ACT_AS = "CLERESTORY_TEST_ACT_AS";

}  // namespace

DeviceOptions test_options(DeviceOptions options) {
    if (options.selector.empty()) options.selector = variable(DEVICE);
    const std::string kind = variable(ACT_AS);
    if (!kind.empty() && options.act_as == ActAs::itself) options.act_as = act_as_by_name(kind);
    return options;
}

unsigned threads_where_possible(unsigned threads) {
    static const bool in_parts = [] {
        const auto ways = TestDevice().handle().getInfo<CL_DEVICE_PARTITION_PROPERTIES>();
        return std::find(ways.begin(), ways.end(), CL_DEVICE_PARTITION_BY_COUNTS) != ways.end();
    }();
    return in_parts ? threads : 0;
}

std::vector<std::string> test_flags() {
    std::vector<std::string> flags;
    for (const auto& [flag, name] : {std::pair("--device", DEVICE), std::pair("--act-as", ACT_AS)}) {
        if (const std::string value = variable(name); !value.empty()) flags.insert(flags.end(), {flag, value});
    }
    return flags;
}

}  // namespace clerestory::test
