#include "draw/gnuplot.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

#include "base/child_process.hpp"
#include "error.hpp"

namespace clerestory::plot {
namespace {

constexpr const char* ADVICE =
    "plots are drawn by gnuplot: install gnuplot-nox (or gnuplot), or ask for .csv or .json, which need none";

/// PATH without what depends on the current folder: empty and relative entries.
std::vector<std::string> program_folders() {
    const char* path = std::getenv("PATH");
    std::string_view rest = path != nullptr ? path : "/usr/local/bin:/usr/bin:/bin";
    std::vector<std::string> folders;
    while (!rest.empty()) {
        const std::string_view entry = rest.substr(0, rest.find(':'));
        if (entry.starts_with('/')) folders.emplace_back(entry);
        rest.remove_prefix(std::min(entry.size() + 1, rest.size()));
    }
    return folders;
}

std::string gnuplot_in(const std::vector<std::string>& folders) {
    for (const std::string& folder : folders) {
        std::string file = folder + "/gnuplot";
        std::error_code error;
        if (std::filesystem::is_regular_file(file, error) && access(file.c_str(), X_OK) == 0) return file;
    }
    throw OutputError(fmt::format("gnuplot is not installed; {}", ADVICE));
}

/// What gnuplot gets of this process's variables: those by which it and its libraries are found, and fonts. None of its
/// own (GNUTERM, GNUPLOT_LIB, GNUPLOT_DRIVER_DIR and the like), and no language, so that plots depend on their script.
std::vector<std::string> gnuplot_environment(const std::vector<std::string>& folders) {
    std::vector<std::string> variables = {fmt::format("PATH={}", fmt::join(folders, ":")), "LC_ALL=C.UTF-8"};
    for (const char* name : {"HOME", "TMPDIR", "LD_LIBRARY_PATH", "FONTCONFIG_FILE", "FONTCONFIG_PATH", "GDFONTPATH",
                             "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_DATA_DIRS"}) {
        if (const char* value = std::getenv(name)) variables.push_back(fmt::format("{}={}", name, value));
    }
    return variables;
}

}  // namespace

Drawing run_gnuplot(const std::string& script) {
    const std::vector<std::string> folders = program_folders();
    // -d: without the user's own settings
    ChildResult gnuplot = run_child({gnuplot_in(folders), "-d"}, gnuplot_environment(folders), script);
    if (gnuplot.signal != 0 || gnuplot.exit_status != 0 || gnuplot.output.empty()) {
        throw OutputError(fmt::format("gnuplot failed ({}): {}", gnuplot.ending(),
                                      gnuplot.messages.empty() ? "it drew nothing" : gnuplot.messages));
    }
    return {std::move(gnuplot.output), std::move(gnuplot.messages)};
}

std::string quoted(const std::string& text) {
    std::string out = "'";
    for (const char c : text) {
        if (c == '\'')
            out += "''";
        else
            out += c == '\n' || c == '\r' ? ' ' : c;
    }
    return out + "'";
}

}  // namespace clerestory::plot
