#include "base/child_process.hpp"

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

namespace clerestory {
namespace {

/// An anonymous temporary file: pipes to and from one child can block each other, files can't.
class Stream {
  public:
    Stream() : file_(std::tmpfile()) {
        if (!file_) throw OutputError(fmt::format("no temporary file: {}", std::strerror(errno)));
    }
    [[nodiscard]] int descriptor() const { return fileno(file_.get()); }

    void write(const std::string& text) {
        const bool whole = std::fwrite(text.data(), 1, text.size(), file_.get()) == text.size();
        if (!whole || std::fflush(file_.get()) != 0) {
            throw OutputError(fmt::format("a temporary file could not be written: {}", std::strerror(errno)));
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
        if (errno != EINTR) throw OutputError(fmt::format("waiting for a program failed: {}", std::strerror(errno)));
    }
    return status;
}

/// Pointers into `texts`, ended by a null pointer, as exec wants them.
std::vector<char*> pointers_to(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    for (std::string& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
}

}  // namespace

std::string ChildResult::ending() const {
    return signal != 0 ? fmt::format("signal {} ({})", signal, strsignal(signal))
                       : fmt::format("exit status {}", exit_status);
}

ChildResult run_child(std::vector<std::string> words, std::vector<std::string> variables, const std::string& input) {
    Stream in;
    const Stream output;
    const Stream messages;
    in.write(input);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in.descriptor(), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, output.descriptor(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, messages.descriptor(), STDERR_FILENO);
    posix_spawn_file_actions_addchdir_np(&actions, "/");
    pid_t child = 0;
    const int error = posix_spawn(&child, words.front().c_str(), &actions, nullptr, pointers_to(words).data(),
                                  pointers_to(variables).data());
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) throw OutputError(fmt::format("{} cannot be started: {}", words.front(), std::strerror(error)));
    const int status = wait_for(child);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 0, WIFSIGNALED(status) ? WTERMSIG(status) : 0, output.read(),
            messages.read()};
}

}  // namespace clerestory
