// libFuzzer's target for command lines, a word a line: whatever the words, parsing ends in a command with all its
// values in range, in help, or in a usage error. Commands themselves are not run.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "commands/commands.hpp"
#include "error.hpp"

namespace {

std::vector<std::string> words_of(const std::string& text) {
    std::vector<std::string> words;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) words.push_back(line);
    return words;
}

}  // namespace

// libFuzzer gives the name.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-*)
    CLI::App app;
    clerestory::commands::describe_program(app);
    app.parse_complete_callback(
        [] { throw CLI::Success(); });  // comes before the command's own callback, which runs it
    std::vector<std::string> words = words_of({reinterpret_cast<const char*>(data), size});
    std::reverse(words.begin(), words.end());  // as CLI11 takes them
    try {
        app.parse(words);
    } catch (const CLI::ParseError&) {
        return 0;  // all was in range, help, the version, or what main() ends with exit code 2 for
    } catch (const clerestory::UsageError&) {
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "broken promise: another exception than a usage error: %s\n", error.what());
        std::abort();
    }
    return 0;
}
