#include "batch/map_loader.hpp"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <utility>

#include "base/clock.hpp"
#include "base/digest.hpp"
#include "batch/cost.hpp"
#include "batch/resume.hpp"
#include "error.hpp"
#include "picture/picture_file.hpp"

namespace clerestory {

namespace {

/// Pages that the last map and the decoder's blocks have left: glibc keeps them, and holes between pictures do not fit
/// the next map's. Takes a millisecond or two.
void give_back_memory() {
#ifdef __GLIBC__
    malloc_trim(0);
#endif
}

}  // namespace

void check_unchanged(const PlannedMap& map) {
    if (file_stamp(map.file) == map.stamp) return;
    throw InputError(
        fmt::format("{}: was replaced or changed after the batch began; run it again with --resume when the file is as "
                    "it should be",
                    map.file));
}

MapLoader::MapLoader(std::vector<std::span<const Job>> groups, std::size_t ahead_bytes, bool resume,
                     std::function<bool()> stop)
    : groups_(std::move(groups)),
      ahead_bytes_(ahead_bytes),
      resume_(resume),
      stop_(std::move(stop)),
      thread_([this](const std::stop_token& stopping) { run(stopping); }) {}

std::optional<LoadedMap> MapLoader::next() {
    std::unique_lock lock(mutex_);
    taker_waits_ = true;
    changed_.notify_all();
    changed_.wait(lock, [&] { return ready_ || finished_; });
    taker_waits_ = false;
    std::optional<LoadedMap> taken = std::exchange(ready_, std::nullopt);
    changed_.notify_all();
    return taken;
}

/// Waits until the last map was taken and this one may be read; false where nobody waits for it any more.
bool MapLoader::wait_for_turn(std::size_t bytes, const std::stop_token& stopping) {
    std::unique_lock lock(mutex_);
    return changed_.wait(lock, stopping, [&] { return !ready_ && (bytes <= ahead_bytes_ || taker_waits_); });
}

LoadedMap MapLoader::look_at(std::span<const Job> jobs) const {
    LoadedMap loaded{jobs, std::vector<bool>(jobs.size(), false), {}, {}, nullptr, 0};
    try {
        check_unchanged(*jobs.front().map);
        loaded.digest = digest_of_file(jobs.front().map->file);
        if (!resume_) return loaded;
        for (std::size_t i = 0; i < jobs.size(); ++i) {
            const Job& job = jobs[i];
            loaded.current[i] = std::all_of(job.outputs.begin(), job.outputs.end(), [&](const std::string& output) {
                return is_current(output, picture_digest(job.recipe, loaded.digest, is_preview(output)));
            });
        }
    } catch (...) {
        loaded.failure = std::current_exception();
    }
    return loaded;
}

void MapLoader::load(LoadedMap& loaded) {
    const Stopwatch watch;
    give_back_memory();
    try {
        loaded.map = read_map_of(loaded.jobs.front().recipe.map);
        // A file that was replaced between its digest and its last row would carry a wrong digest for ever.
        check_unchanged(*loaded.jobs.front().map);
    } catch (...) {
        loaded.map.reset();
        loaded.failure = std::current_exception();
    }
    give_back_memory();
    loaded.seconds = watch.seconds();
}

void MapLoader::run(const std::stop_token& stopping) {
    for (const auto& jobs : groups_) {
        if (stop_()) break;
        LoadedMap loaded = look_at(jobs);
        const bool all_current = std::find(loaded.current.begin(), loaded.current.end(), false) == loaded.current.end();
        const bool wanted = !loaded.failure && !all_current;
        const PlannedMap& map = *jobs.front().map;
        if (!wait_for_turn(wanted ? reading_bytes(map.width, map.height) : 0, stopping)) break;
        if (wanted) load(loaded);
        const std::lock_guard lock(mutex_);
        ready_ = std::move(loaded);
        changed_.notify_all();
    }
    const std::lock_guard lock(mutex_);
    finished_ = true;
    changed_.notify_all();
}

}  // namespace clerestory
