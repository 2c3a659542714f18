#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string>

#include "base/nearest_word.hpp"
#include "clerestory/version.hpp"
#include "commands/caches.hpp"
#include "commands/commands.hpp"
#include "device.hpp"
#include "error.hpp"

namespace clerestory::commands {
namespace {

/// What a report of a problem should name. A machine without a device is no error here.
std::string version_text() {
    const BuildInfo& build = build_info();
    std::string device;
    prepare_caches();
    try {
        const DeviceInfo info = chosen_device();
        device = fmt::format("{} ({}), driver {}", info.name, info.version, info.driver);
    } catch (const Error& error) {
        device = fmt::format("none: {}", error.what());
    }
    return fmt::format("clerestory {}\ncommit    {}\ncompiler  {}\ndevice    {}", build.version, build.commit,
                       build.compiler, device);
}

/// A flag takes one argument, with commas where it is a list: what follows is the map, never a second value.
void let_flags_take_one_argument(CLI::App& app) {
    for (CLI::App* command : app.get_subcommands({})) {
        for (CLI::Option* option : command->get_options()) {
            if (!option->get_positional()) option->allow_extra_args(false);
        }
    }
}

}  // namespace

void describe_program(CLI::App& app) {
    app.name("clerestory");
    app.description(
        "Clerestory lights a sphere with a photographed environment and says how much error each second bought.");
    app.require_subcommand(1);
    app.set_version_flag("--version", version_text, "Version, commit, compiler and OpenCL device");
    app.footer(
        "\nEvery command has --help with an example.\n"
        "Exit codes: 0 done, 1 a comparison or some jobs failed, 2 usage, 3 bad input, 4 OpenCL device or kernel, "
        "5 output could not be written.");
    add_info(app);
    add_sample(app);
    add_render(app);
    add_sheet(app);
    add_compare(app);
    add_study(app);
    add_reproduce(app);
    add_batch(app);
    add_merge(app);
    add_devices(app);
    add_fresnel(app);
    let_flags_take_one_argument(app);
}

std::string usage_message(const CLI::App& app, const CLI::ParseError& error, const std::vector<std::string>& words) {
    std::vector<std::string> commands;
    for (const CLI::App* command : app.get_subcommands({})) commands.push_back(command->get_name());
    const std::string first = words.empty() ? std::string() : words.front();
    if (std::find(commands.begin(), commands.end(), first) == commands.end()) {
        if (first.empty()) return fmt::format("a command is required: {}", fmt::join(commands, ", "));
        if (first.front() != '-') {
            return fmt::format("no command is named {}{}", first, did_you_mean(first, commands));
        }
        return fmt::format("no flag is named {}; `clerestory --help` lists commands", first);
    }
    const CLI::App* command = app.get_subcommand(first);
    std::vector<std::string> flags;
    for (const CLI::Option* option : command->get_options()) {
        for (const auto& name : option->get_lnames()) flags.push_back("--" + name);
        for (const auto& name : option->get_snames()) flags.push_back("-" + name);
    }
    for (const std::string& word : words) {
        const std::string flag = word.substr(0, word.find('='));
        const bool known = std::find(flags.begin(), flags.end(), flag) != flags.end();
        if (!flag.starts_with("--") || flag == "--" || known) continue;
        return fmt::format("{} has no flag {}{}", first, flag, did_you_mean(flag, flags));
    }
    return fmt::format("{}; see `clerestory {} --help`", error.what(), first);
}

}  // namespace clerestory::commands
