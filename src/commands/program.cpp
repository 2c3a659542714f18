#include <fmt/format.h>

#include <string>

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

}  // namespace clerestory::commands
