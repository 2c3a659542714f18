// describe FOLDER: writes the program's manual pages and shell completions, from the description that --help prints.
#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "base/atomic_file.hpp"
#include "commands/commands.hpp"
#include "describe/command_line.hpp"
#include "describe/completion.hpp"
#include "describe/man_page.hpp"

namespace {

void write_all(const std::filesystem::path& folder) {
    using namespace clerestory::describe;
    CLI::App app;
    clerestory::commands::describe_program(app);
    const Command program = read_command_line(app);
    const auto write_page = [&](const Command& command) {
        clerestory::write_text(folder / "man1" / (page_name(program, command) + ".1"),
                               man_page(program, command, "Clerestory " CLERESTORY_VERSION));
    };
    write_page(program);
    for (const Command& command : program.commands) write_page(command);
    clerestory::write_text(folder / "completions" / "clerestory", bash_completion(program));
    clerestory::write_text(folder / "completions" / "_clerestory", zsh_completion(program));
    clerestory::write_text(folder / "completions" / "clerestory.fish", fish_completion(program));
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        fmt::print(stderr, "usage: clerestory_describe FOLDER\n");
        return 2;
    }
    try {
        write_all(argv[1]);
    } catch (const std::exception& error) {
        fmt::print(stderr, "clerestory_describe: {}\n", error.what());
        return 1;
    }
    return 0;
}
