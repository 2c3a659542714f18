#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/child_process.hpp"
#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "error.hpp"
#include "render/known_answers.hpp"

namespace clerestory::commands {
namespace {

constexpr double GIB = 1024.0 * 1024.0 * 1024.0;

// With nothing compiled, PoCL took 5 s on two cores, Intel's runtime 7.
constexpr unsigned ANSWER_SECONDS = 120;

constexpr const char* RIGHT = "known answers right";

/// What a device answers to questions whose answers are known.
struct Verdict {
    bool usable = false;
    std::string text;
};

/// A program's words without its name before them and the end of the line.
std::string line_of(std::string text) {
    constexpr std::string_view lead = "clerestory: ";
    if (text.starts_with(lead)) text.erase(0, lead.size());
    text.resize(text.find_last_not_of('\n') + 1);
    return text;
}

/// Asked in a process of its own: a driver that crashes takes only that along.
Verdict verdict_of(const DeviceInfo& info, const Common& common) {
    if (!info.trouble.empty()) return {false, info.trouble};
    if (!info.has_compiler) return {false, "it cannot compile kernels"};
    std::error_code error;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
    if (error) return {false, fmt::format("it could not be asked: /proc/self/exe: {}", error.message())};
    std::vector<std::string> variables;
    for (char** variable = environ; *variable != nullptr; ++variable) variables.emplace_back(*variable);
    std::vector<std::string> words = {program, "devices", "--ask", "--device", info.selector};
    if (common.device.act_as != ActAs::itself)
        words.insert(words.end(), {"--act-as", act_as_name(common.device.act_as)});
    const ChildResult child = run_child(std::move(words), std::move(variables), "");
    if (child.signal == SIGALRM) return {false, fmt::format("it has not answered for {} s", ANSWER_SECONDS)};
    if (child.signal != 0) return {false, "its driver ends the program by " + child.ending()};
    if (child.exit_status != 0) return {false, line_of(child.messages)};
    return {true, child.output.empty() ? RIGHT : fmt::format("right where it answers: {}", line_of(child.output))};
}

/// The process that asks: opens the device that was named, as a command would, and tells what it failed to answer.
void ask(const Common& common) {
    alarm(ANSWER_SECONDS);
    const Device device = open_device(common);
    fmt::print("{}", known_answers(device).failed);
}

nlohmann::json to_json(const DeviceInfo& info, const Verdict& verdict) {
    return {{"selector", info.selector},
            {"platform", info.platform},
            {"name", info.name},
            {"version", info.version},
            {"driver", info.driver},
            {"cpu", info.is_cpu},
            {"fp64", info.has_fp64},
            {"compiler", info.has_compiler},
            {"trouble", info.trouble.empty() ? nlohmann::json() : nlohmann::json(info.trouble)},
            {"usable", verdict.usable},
            {"verdict", verdict.text},
            {"compute_units", info.compute_units},
            {"max_work_group", info.max_work_group},
            {"memory_bytes", info.memory_bytes},
            {"max_allocation_bytes", info.max_allocation_bytes}};
}

void print(const DeviceInfo& info, const Verdict& verdict) {
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
    fmt::print("     verdict   {}{}\n", verdict.usable ? "" : "cannot be used: ", verdict.text);
}

void run(const Common& common) {
    (void)device_options(common);  // before the first call of OpenCL: where PoCL keeps its kernels
    const auto devices = list_devices();
    nlohmann::json report = {{"devices", nlohmann::json::array()}};
    bool usable = false;
    for (const auto& info : devices) {
        const Verdict verdict = verdict_of(info, common);
        usable = usable || verdict.usable;
        report["devices"].push_back(to_json(info, verdict));
        if (common.json != "-") print(info, verdict);
    }
    emit_json(common, report);
    if (devices.empty()) {
        throw DeviceError("no OpenCL device on this machine: install pocl-opencl-icd, or a driver of your GPU");
    }
    if (!usable) throw DeviceError("no OpenCL device that works on this machine");
}

}  // namespace

void add_devices(CLI::App& app) {
    auto* command =
        app.add_subcommand("devices", "List the OpenCL devices, what each supports, and whether it computes rightly");
    auto common = std::make_shared<Common>();
    auto asked = std::make_shared<bool>(false);
    add_common(*command, *common, "  clerestory devices\n  clerestory devices --json -");
    command->add_flag("--ask", *asked)->group("");  // see verdict_of
    command->callback([common, asked] { *asked ? ask(*common) : run(*common); });
}

}  // namespace clerestory::commands
