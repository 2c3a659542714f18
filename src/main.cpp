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

int run(int argc, char** argv) {
    CLI::App app;
    clerestory::commands::describe_program(app);
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
