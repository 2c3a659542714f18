#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "error.hpp"

namespace clerestory::commands {
namespace {

constexpr double GIB = 1024.0 * 1024.0 * 1024.0;

nlohmann::json to_json(const DeviceInfo& info) {
    return {{"selector", info.selector},
            {"platform", info.platform},
            {"name", info.name},
            {"version", info.version},
            {"driver", info.driver},
            {"cpu", info.is_cpu},
            {"fp64", info.has_fp64},
            {"compiler", info.has_compiler},
            {"trouble", info.trouble.empty() ? nlohmann::json() : nlohmann::json(info.trouble)},
            {"compute_units", info.compute_units},
            {"max_work_group", info.max_work_group},
            {"memory_bytes", info.memory_bytes},
            {"max_allocation_bytes", info.max_allocation_bytes}};
}

void print(const DeviceInfo& info) {
    if (!info.trouble.empty()) {
        fmt::print("{}  cannot be used: {}\n     platform  {}, {}\n", info.selector, info.trouble, info.platform,
                   info.version);
        return;
    }
    fmt::print("{}  {} ({})\n", info.selector, info.name, info.is_cpu ? "CPU" : "accelerator");
    fmt::print("     platform  {}, {}\n", info.platform, info.version);
    fmt::print("     driver    {}\n", info.driver);
    fmt::print("     units     {}, work-groups up to {}\n", info.compute_units, info.max_work_group);
    fmt::print("     memory    {:.1f} GiB, {:.1f} GiB in one buffer\n", static_cast<double>(info.memory_bytes) / GIB,
               static_cast<double>(info.max_allocation_bytes) / GIB);
    fmt::print("     supports  double precision: {}; compiling kernels: {}\n", info.has_fp64 ? "yes" : "no",
               info.has_compiler ? "yes" : "no");
}

void run(const Common& common) {
    const auto devices = list_devices();
    nlohmann::json report = {{"devices", nlohmann::json::array()}};
    for (const auto& info : devices) report["devices"].push_back(to_json(info));
    if (common.json != "-") {
        for (const auto& info : devices) print(info);
    }
    emit_json(common, report);
    const auto trouble = [](const DeviceInfo& info) { return !info.trouble.empty(); };
    if (!devices.empty() && std::all_of(devices.begin(), devices.end(), trouble)) {
        throw DeviceError("no OpenCL device that works on this machine");
    }
    if (devices.empty()) {
        throw DeviceError("no OpenCL device on this machine: install pocl-opencl-icd, or a driver of your GPU");
    }
}

}  // namespace

void add_devices(CLI::App& app) {
    auto* command = app.add_subcommand("devices", "List the OpenCL devices and what each supports");
    auto common = std::make_shared<Common>();
    add_common(*command, *common, "  clerestory devices\n  clerestory devices --json -");
    command->callback([common] { run(*common); });
}

}  // namespace clerestory::commands
