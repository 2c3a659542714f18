#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "batch/plan.hpp"
#include "cl/device.hpp"
#include "render/renderer.hpp"

namespace clerestory {

enum class JobStatus {
    done,     ///< rendered and written
    skipped,  ///< its outputs stood already, of the same map and parameters
    failed,
    not_run,  ///< the batch was stopped before
};
std::string status_name(JobStatus status);

struct JobResult {
    JobStatus status = JobStatus::not_run;
    std::string error;     ///< why it failed
    int exit_code = 0;     ///< what `render` would have ended with
    StageSeconds seconds;  ///< by stage; a map's reading and tables count with its first picture
};

struct BatchOptions {
    DeviceOptions device;
    bool resume = false;           ///< leave jobs alone whose outputs are current
    std::size_t memory_bytes = 0;  ///< that maps read ahead may take; 0: a tenth of what the largest job needs
};

/// What a batch tells while it runs; called from any thread, never two at a time.
struct BatchEvents {
    std::function<bool()> stop;  ///< asked between jobs; true ends the batch after what is being written
    std::function<void(const Job&, const JobResult&)> finished;
    std::function<void(const std::string&)> warning;
};

struct BatchResult {
    std::vector<JobResult> jobs;  ///< as the jobs were given
    bool stopped = false;
    std::string device;    ///< its name; empty where it could not be opened
    std::string platform;  ///< its version
    double seconds = 0;
    std::size_t peak_memory_bytes = 0;  ///< of the process, as the system says
    [[nodiscard]] std::size_t count(JobStatus status) const;
    /// No job could run, each for the device's sake: that is the batch's failure, not some jobs'.
    [[nodiscard]] bool device_failed() const;
};

/// Renders jobs on one device: the next map is read and the last picture written while one is rendered. A failure is a
/// job's own: the rest goes on. Memory is bounded by the largest job's, whatever their number.
/// Where the device cannot be opened every job fails with that.
BatchResult run_batch(std::span<const Job> jobs, const BatchOptions& options, const BatchEvents& events);

/// Memory that a batch of these jobs takes at its peak, the process itself included.
std::size_t batch_memory(std::span<const Job> jobs, const BatchOptions& options);

}  // namespace clerestory
