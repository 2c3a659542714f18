#pragma once

#include <chrono>

namespace clerestory {

/// Seconds on a clock that only goes forward.
inline double seconds_now() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Seconds since it was made or restarted.
class Stopwatch {
  public:
    [[nodiscard]] double seconds() const { return seconds_now() - start_; }
    /// The seconds so far, counting from 0 again.
    double lap() {
        const double now = seconds_now();
        const double lap = now - start_;
        start_ = now;
        return lap;
    }

  private:
    double start_ = seconds_now();
};

}  // namespace clerestory
