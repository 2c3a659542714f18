#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <iostream>
#include <new>
#include <string>

#include "base/atomic_file.hpp"
#include "base/durable.hpp"
#include "base/standard_streams.hpp"
#include "base/text_escape.hpp"
#include "commands/commands.hpp"
#include "error.hpp"

namespace {

constexpr int EXIT_USAGE = 2;
constexpr int EXIT_DEVICE = 4;
constexpr int EXIT_OUTPUT = 5;

void complain(const std::string& text) { clerestory::print_to_stderr("clerestory: " + text + "\n"); }

int run(int argc, char** argv) {
    CLI::App app;
    clerestory::commands::describe_program(app);
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& asked) {
        return app.exit(asked);
    } catch (const CLI::ParseError& error) {
        complain(clerestory::one_line(clerestory::commands::usage_message(app, error, {argv + 1, argv + argc})));
        return EXIT_USAGE;
    }
    return 0;
}

int run_to_its_end(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const clerestory::Error& error) {
        complain(error.what());
        return error.exit_code();
    } catch (const std::bad_alloc&) {
        complain("out of memory; a smaller map needs less");
        return EXIT_DEVICE;
    } catch (const std::exception& error) {
        if (std::ferror(stdout) != 0) return 0;  // told below
        complain("unexpected failure: " + clerestory::one_line(error.what()));
        return EXIT_DEVICE;
    }
}

/// Before the exit code says that files are there. The other outcome is told already where there is one.
int bring_to_disk(int code) {
    try {
        clerestory::sync_remembered();
    } catch (const clerestory::Error& error) {
        complain(error.what());
        if (code == 0) return error.exit_code();
    }
    return code;
}

}  // namespace

int main(int argc, char** argv) {
    clerestory::open_standard_streams();
    clerestory::keep_all_but_results_private();
    const int code = bring_to_disk(run_to_its_end(argc, argv));
    std::cout.flush();
    // A disk may be full, and say so no sooner than here.
    const bool written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good();
    if (written || code != 0) return code;
    complain("what was to go to stdout could not be written; free some space or write elsewhere");
    return EXIT_OUTPUT;
}
