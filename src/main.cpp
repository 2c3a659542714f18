#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>

#include "base/durable.hpp"
#include "commands/commands.hpp"
#include "error.hpp"

namespace {

constexpr int EXIT_USAGE = 2;
constexpr int EXIT_DEVICE = 4;
constexpr int EXIT_OUTPUT = 5;

int run(int argc, char** argv) {
    CLI::App app;
    clerestory::commands::describe_program(app);
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& asked) {
        return app.exit(asked);
    } catch (const CLI::ParseError& error) {
        fmt::print(stderr, "clerestory: {}\n",
                   clerestory::commands::usage_message(app, error, {argv + 1, argv + argc}));
        return EXIT_USAGE;
    }
    return 0;
}

int run_to_its_end(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const clerestory::Error& error) {
        fmt::print(stderr, "clerestory: {}\n", error.what());
        return error.exit_code();
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "clerestory: out of memory; a smaller map needs less\n");
        return EXIT_DEVICE;
    } catch (const std::exception& error) {
        if (std::ferror(stdout) != 0) return 0;  // told below
        fmt::print(stderr, "clerestory: unexpected failure: {}\n", error.what());
        return EXIT_DEVICE;
    }
}

/// Before the exit code says that files are there. The other outcome is told already where there is one.
int bring_to_disk(int code) {
    try {
        clerestory::sync_remembered();
    } catch (const clerestory::Error& error) {
        fmt::print(stderr, "clerestory: {}\n", error.what());
        if (code == 0) return error.exit_code();
    }
    return code;
}

}  // namespace

int main(int argc, char** argv) {
    const int code = bring_to_disk(run_to_its_end(argc, argv));
    std::cout.flush();
    // A disk may be full, and say so no sooner than here.
    const bool written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good();
    if (written || code != 0) return code;
    fmt::print(stderr,
               "clerestory: what was to go to stdout could not be written; free some space or write elsewhere\n");
    return EXIT_OUTPUT;
}
