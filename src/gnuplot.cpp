#include "gnuplot.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

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

/// Starts gnuplot with the three streams as its own; returns waitpid's status.
int spawn_and_wait(const Stream& script, const Stream& output, const Stream& messages) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, script.descriptor(), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, output.descriptor(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, messages.descriptor(), STDERR_FILENO);
    std::string program = "gnuplot";
    std::string no_user_settings = "-d";
    const std::array<char*, 3> arguments = {program.data(), no_user_settings.data(), nullptr};
    pid_t child = 0;
    const int error = posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments.data(), environ);
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
