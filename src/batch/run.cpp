#include "batch/run.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "base/atomic_file.hpp"
#include "base/clock.hpp"
#include "batch/cost.hpp"
#include "batch/map_loader.hpp"
#include "batch/picture_writer.hpp"
#include "batch/resume.hpp"
#include "error.hpp"
#include "picture/picture_file.hpp"
#include "render/known_answers.hpp"

namespace clerestory {
namespace {

/// What the process takes before it holds a map: PoCL, its compiler, the kernels.
constexpr std::size_t PROCESS_BYTES = std::size_t{90} << 20;
/// Part of the largest job's memory that may be taken beside it.
constexpr std::size_t AHEAD_PART = 10;
/// As DeviceError's; also of what has no code of its own.
constexpr int EXIT_DEVICE = 4;

std::size_t largest_job(std::span<const Job> jobs) {
    std::size_t most = 0;
    for (const Job& job : jobs) most = std::max(most, job.memory_bytes);
    return PROCESS_BYTES + most;
}

std::size_t ahead_bytes(std::span<const Job> jobs, const BatchOptions& options) {
    return options.memory_bytes != 0 ? options.memory_bytes : largest_job(jobs) / AHEAD_PART;
}

std::vector<std::span<const Job>> groups_of(std::span<const Job> jobs) {
    std::vector<std::span<const Job>> groups;
    for (std::size_t begin = 0; begin < jobs.size();) {
        std::size_t end = begin + 1;
        while (end < jobs.size() && same_scene(jobs[begin], jobs[end])) ++end;
        groups.push_back(jobs.subspan(begin, end - begin));
        begin = end;
    }
    return groups;
}

JobResult failed(const std::exception_ptr& failure) {
    JobResult result;
    result.status = JobStatus::failed;
    result.exit_code = EXIT_DEVICE;
    try {
        std::rethrow_exception(failure);
    } catch (const Error& error) {
        result.error = error.what();
        result.exit_code = error.exit_code();
    } catch (const std::bad_alloc&) {
        result.error = "out of memory; a smaller map or picture needs less";
    } catch (const std::exception& error) {
        result.error = fmt::format("unexpected failure: {}", error.what());
    }
    return result;
}

class Batch {
  public:
    Batch(std::span<const Job> jobs, const BatchOptions& options, const BatchEvents& events)
        : jobs_(jobs), options_(options), events_(events), ahead_bytes_(ahead_bytes(jobs, options)) {
        result_.jobs.resize(jobs.size());
    }

    BatchResult run() {
        const Stopwatch watch;
        remove_leftovers();
        if (open_device()) work();
        result_.stopped = stopped();
        result_.seconds = watch.seconds();
        result_.peak_memory_bytes = peak_memory();
        return std::move(result_);
    }

  private:
    static std::size_t peak_memory() {
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
    }

    [[nodiscard]] bool stopped() const { return events_.stop && events_.stop(); }

    /// What killed processes were writing when they ended.
    void remove_leftovers() const {
        std::set<std::filesystem::path> folders;
        for (const Job& job : jobs_) {
            for (const auto& output : job.outputs) folders.insert(std::filesystem::path(output).parent_path());
        }
        for (const auto& folder : folders) remove_abandoned(folder);
    }

    bool open_device() {
        try {
            device_.emplace(clerestory::open_device(options_.device));
            builder_.emplace(*device_);
            renderer_.emplace(*device_);
            result_.device = device_->info().name;
            result_.platform = device_->info().version;
            return true;
        } catch (const UsageError&) {
            throw;  // a flag, not a machine: nothing of the batch is at fault
        } catch (...) {
            for (const Job& job : jobs_) settle(job, failed(std::current_exception()));
            return false;
        }
    }

    void work() {
        PictureWriter writer([this](const FinishedPicture& picture, double seconds, const std::exception_ptr& failure) {
            written(picture, seconds, failure);
        });
        MapLoader loader(groups_of(jobs_), ahead_bytes_, options_.resume, [this] { return stopped(); });
        while (auto loaded = loader.next()) render_group(*loaded, writer);
        writer.finish();
    }

    void render_group(LoadedMap& loaded, PictureWriter& writer) {
        std::unique_ptr<Scene> scene;
        StageSeconds before;
        if (loaded.map) {
            before.emplace_back("read", loaded.seconds);
            try {
                scene = build_scene(loaded, before);
            } catch (...) {
                loaded.failure = std::current_exception();
            }
        }
        for (std::size_t i = 0; i < loaded.jobs.size() && !stopped(); ++i) {
            const Job& job = loaded.jobs[i];
            if (loaded.failure) {
                settle(job, failed(loaded.failure));
            } else if (loaded.current[i]) {
                settle(job, {JobStatus::skipped, {}, 0, {}});
            } else {
                render_job(job, *scene, loaded.digest, std::exchange(before, {}), writer);
            }
        }
    }

    std::unique_ptr<Scene> build_scene(LoadedMap& loaded, StageSeconds& seconds) {
        const MapOptions& options = loaded.jobs.front().recipe.map;
        Stopwatch watch;
        std::unique_ptr<Scene> scene;
        try {
            scene = std::make_unique<Scene>(*device_, *builder_, std::move(*loaded.map), scene_options_of(options));
        } catch (const InputError& error) {
            throw InputError(fmt::format("{}: {}", options.file, error.what()));
        }
        seconds.emplace_back("tables", watch.lap());
        for (const MapNote& note : scene->map().source.notes) warn(fmt::format("{}: {}", options.file, note.text));
        if (scene->repaired() != 0) {
            warn(
                fmt::format("{}: {} NaN, infinite or negative texels were blackened", options.file, scene->repaired()));
        }
        if (scene->distribution().black()) warn(fmt::format("{}: the map is black", options.file));
        return scene;
    }

    void render_job(const Job& job, const Scene& scene, const std::string& map_digest, StageSeconds seconds,
                    PictureWriter& writer) {
        try {
            check_unchanged(*job.map);
            // A picture too large to stand beside another is written before the next begins.
            if (picture_bytes(job.recipe.render.size) > ahead_bytes_) writer.finish();
            FinishedPicture finished;
            finished.job = &job;
            finished.picture = renderer_->render(scene, job.recipe.render);
            Stopwatch watch;
            if (std::any_of(job.outputs.begin(), job.outputs.end(), is_preview)) {
                finished.preview = preview_of(finished.picture, job.recipe.tone, renderer_->display());
                finished.picture.seconds.emplace_back("preview", watch.lap());
            }
            // No seconds among the attributes: a picture's bytes are the same whenever and wherever it is rendered.
            finished.header = flat_header(describe_picture(job.recipe.map, job.recipe.render, scene.map(), *device_),
                                          nlohmann::json::object());
            finished.header[DIGEST_KEY].text = picture_digest(job.recipe, map_digest, false);
            finished.text[DIGEST_KEY] = picture_digest(job.recipe, map_digest, true);
            seconds.insert(seconds.end(), finished.picture.seconds.begin(), finished.picture.seconds.end());
            finished.picture.seconds = std::move(seconds);
            writer.write(std::move(finished));
        } catch (const DeviceError&) {
            settle(job, failed(std::current_exception()));
            renderer_.emplace(*device_);  // what it had begun to make may be half made
        } catch (...) {
            settle(job, failed(std::current_exception()));
        }
    }

    void written(const FinishedPicture& picture, double seconds, const std::exception_ptr& failure) {
        JobResult result;
        if (failure) result = failed(failure);
        if (!failure) result.status = JobStatus::done;
        // Room for these alone: a record of every job is kept to the end.
        result.seconds.reserve(picture.picture.seconds.size() + 1);
        result.seconds = picture.picture.seconds;
        result.seconds.emplace_back("write", seconds);
        settle(*picture.job, std::move(result));
    }

    void settle(const Job& job, JobResult result) {
        const std::lock_guard lock(mutex_);
        JobResult& kept = result_.jobs[static_cast<std::size_t>(&job - jobs_.data())];
        kept = std::move(result);
        if (events_.finished) events_.finished(job, kept);
    }

    /// Once for each line: scenes of one map say the same of it.
    void warn(const std::string& line) {
        const std::lock_guard lock(mutex_);
        if (events_.warning && warned_.insert(line).second) events_.warning(line);
    }

    std::span<const Job> jobs_;
    const BatchOptions& options_;
    const BatchEvents& events_;
    std::size_t ahead_bytes_;
    std::mutex mutex_;
    std::set<std::string> warned_;
    BatchResult result_;
    std::optional<Device> device_;
    std::optional<TableBuilder> builder_;
    std::optional<Renderer> renderer_;
};

}  // namespace

std::string status_name(JobStatus status) {
    constexpr std::array NAMES = {"done", "skipped", "failed", "not run"};
    return NAMES.at(static_cast<std::size_t>(status));
}

std::size_t BatchResult::count(JobStatus status) const {
    return static_cast<std::size_t>(
        std::count_if(jobs.begin(), jobs.end(), [&](const JobResult& job) { return job.status == status; }));
}

bool BatchResult::device_failed() const {
    return !jobs.empty() && std::all_of(jobs.begin(), jobs.end(), [](const JobResult& job) {
        return job.status == JobStatus::failed && job.exit_code == EXIT_DEVICE;
    });
}

BatchResult run_batch(std::span<const Job> jobs, const BatchOptions& options, const BatchEvents& events) {
    return Batch(jobs, options, events).run();
}

std::size_t batch_memory(std::span<const Job> jobs, const BatchOptions& options) {
    const std::size_t allowed = ahead_bytes(jobs, options);
    std::size_t map = 0;
    std::size_t picture = 0;
    for (const Job& job : jobs) {
        const std::size_t read = reading_bytes(job.map->width, job.map->height);
        const std::size_t written = picture_bytes(job.recipe.render.size);
        if (read <= allowed) map = std::max(map, read);
        if (written <= allowed) picture = std::max(picture, written);
    }
    return largest_job(jobs) + map + picture;
}

}  // namespace clerestory
