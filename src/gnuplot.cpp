#include "gnuplot.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string_view>
#include <vector>

#include "error.hpp"

namespace clerestory::plot {
namespace {

constexpr const char* ADVICE =
    "plots are drawn by gnuplot: install gnuplot-nox (or gnuplot), or ask for .csv or .json, which need none";

/// An anonymous temporary file: pipes to and from one child can block each other, files can't.
class Stream {
  public:
    Stream() : file_(std::tmpfile()) {
        if (!file_) throw OutputError(fmt::format("no temporary file for gnuplot: {}", std::strerror(errno)));
    }
    [[nodiscard]] int descriptor() const { return fileno(file_.get()); }

    void write(const std::string& text) {
        const bool whole = std::fwrite(text.data(), 1, text.size(), file_.get()) == text.size();
        if (!whole || std::fflush(file_.get()) != 0) {
            throw OutputError(fmt::format("the script for gnuplot could not be written: {}", std::strerror(errno)));
        }
        std::rewind(file_.get());
    }

    [[nodiscard]] std::string read() const {
        std::string text;
        std::array<char, 1 << 16> part{};
        std::rewind(file_.get());
        for (std::size_t n = 0; (n = std::fread(part.data(), 1, part.size(), file_.get())) > 0;) {
            text.append(part.data(), n);
        }
        return text;
    }

  private:
    struct Close {
        void operator()(std::FILE* file) const { std::fclose(file); }
    };
    std::unique_ptr<std::FILE, Close> file_;
};

int wait_for(pid_t child) {
    int status = 0;
    while (waitpid(child, &status, 0) < 0) {
        if (errno != EINTR) throw OutputError(fmt::format("waiting for gnuplot failed: {}", std::strerror(errno)));
    }
    return status;
}

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

/// Pointers into `texts`, ended by a null pointer, as exec wants them.
std::vector<char*> pointers_to(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    for (std::string& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
}

/// Starts gnuplot with the three streams as its own; returns waitpid's status. It runs in the root folder: its script
/// names no file, and whatever else it may look for beside itself is not the user's.
int spawn_and_wait(const Stream& script, const Stream& output, const Stream& messages) {
    const std::vector<std::string> folders = program_folders();
    std::vector<std::string> words = {gnuplot_in(folders), "-d"};  // -d: without the user's own settings
    std::vector<std::string> variables = gnuplot_environment(folders);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, script.descriptor(), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, output.descriptor(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, messages.descriptor(), STDERR_FILENO);
    posix_spawn_file_actions_addchdir_np(&actions, "/");
    pid_t child = 0;
    const int error = posix_spawn(&child, words.front().c_str(), &actions, nullptr, pointers_to(words).data(),
                                  pointers_to(variables).data());
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) throw OutputError(fmt::format("gnuplot cannot be started ({}); {}", std::strerror(error), ADVICE));
    return wait_for(child);
}

}  // namespace

Drawing run_gnuplot(const std::string& script) {
    Stream input;
    const Stream output;
    const Stream messages;
    input.write(script);
    const int status = spawn_and_wait(input, output, messages);
    Drawing drawing{output.read(), messages.read()};
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || drawing.output.empty()) {
        throw OutputError(fmt::format("gnuplot failed ({}): {}",
                                      WIFEXITED(status) ? fmt::format("exit {}", WEXITSTATUS(status))
                                                        : fmt::format("signal {}", WTERMSIG(status)),
                                      drawing.messages.empty() ? "it drew nothing" : drawing.messages));
    }
    return drawing;
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
