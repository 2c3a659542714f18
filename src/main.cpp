#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>

#include "commands/commands.hpp"
#include "error.hpp"

namespace {

constexpr int EXIT_USAGE = 2;
constexpr int EXIT_DEVICE = 4;

void add_commands(CLI::App& app) {
    using namespace clerestory::commands;
    add_info(app);
    add_sample(app);
    add_render(app);
    add_sheet(app);
    add_compare(app);
    add_study(app);
    add_reproduce(app);
    add_devices(app);
    add_fresnel(app);
}

int run(int argc, char** argv) {
    CLI::App app{
        "Clerestory lights a sphere with a photographed environment and says how much error each second bought.",
        "clerestory"};
    app.require_subcommand(1);
    app.set_version_flag("--version", CLERESTORY_VERSION);
    app.footer(
        "\nEvery command has --help with an example.\n"
        "Exit codes: 0 done, 1 a comparison or some jobs failed, 2 usage, 3 bad input, 4 OpenCL device or kernel, "
        "5 output could not be written.");
    add_commands(app);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : EXIT_USAGE;
    }
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const clerestory::Error& error) {
        fmt::print(stderr, "clerestory: {}\n", error.what());
        return error.exit_code();
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "clerestory: out of memory; a smaller map needs less\n");
        return EXIT_DEVICE;
    } catch (const std::exception& error) {
        fmt::print(stderr, "clerestory: unexpected failure: {}\n", error.what());
        return EXIT_DEVICE;
    }
}
