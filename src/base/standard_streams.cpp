#include "base/standard_streams.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <ctime>

namespace clerestory {
namespace {

/// While it lives, writing into a pipe that nobody reads raises no signal in this thread.
class WithoutBrokenPipes {
  public:
    WithoutBrokenPipes() {
        sigemptyset(&pipe_);
        sigaddset(&pipe_, SIGPIPE);
        sigset_t pending;
        sigpending(&pending);
        was_pending_ = sigismember(&pending, SIGPIPE) == 1;
        pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
    }
    WithoutBrokenPipes(const WithoutBrokenPipes&) = delete;
    WithoutBrokenPipes& operator=(const WithoutBrokenPipes&) = delete;
    ~WithoutBrokenPipes() {
        constexpr timespec AT_ONCE{};
        if (broken_ && !was_pending_) sigtimedwait(&pipe_, nullptr, &AT_ONCE);
        pthread_sigmask(SIG_SETMASK, &before_, nullptr);
    }
    void broke() { broken_ = true; }

  private:
    sigset_t pipe_{};
    sigset_t before_{};
    bool was_pending_ = false;
    bool broken_ = false;
};

}  // namespace

void open_standard_streams() noexcept {
    for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream) {
        if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
        // The lowest number that is free is this one. The wrong direction, so that use fails.
        const int mode = stream == STDIN_FILENO ? O_WRONLY : O_RDONLY;
        if (::open("/dev/null", mode) < 0) ::open("/", O_RDONLY | O_DIRECTORY);
    }
}

void print_to_stderr(std::string_view text) noexcept {
    WithoutBrokenPipes pipes;
    while (!text.empty()) {
        const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0 && errno == EPIPE) pipes.broke();
        if (written <= 0) return;
        text.remove_prefix(static_cast<std::size_t>(written));
    }
}

}  // namespace clerestory
