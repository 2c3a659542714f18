#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "batch/plan.hpp"
#include "image.hpp"

namespace clerestory {

/// Jobs that share a map, with the map as far as it is needed.
struct LoadedMap {
    std::span<const Job> jobs;
    std::vector<bool> current;  ///< a job's outputs stand already
    std::string digest;         ///< of the map's file
    std::optional<RadianceMap> map;
    std::exception_ptr failure;  ///< why there is no map, where a job wants it
    double seconds = 0;          ///< that reading took
};

/// Reads maps in a thread of its own, one ahead of the one in use where the memory for it is allowed.
class MapLoader {
  public:
    /// `groups` of jobs that share a map; they must outlive it.
    ///   ahead_bytes  most memory that reading a map may take while another is in use
    ///   resume       jobs whose outputs are current need no map
    ///   stop         asked before each map; once true, the rest comes without
    MapLoader(std::vector<std::span<const Job>> groups, std::size_t ahead_bytes, bool resume,
              std::function<bool()> stop);
    MapLoader(const MapLoader&) = delete;
    MapLoader& operator=(const MapLoader&) = delete;

    /// The next group; nothing after the last. The map taken before must be gone by then.
    std::optional<LoadedMap> next();

  private:
    void run(const std::stop_token& stopping);
    LoadedMap look_at(std::span<const Job> jobs) const;
    static void load(LoadedMap& loaded);
    bool wait_for_turn(std::size_t bytes, const std::stop_token& stopping);

    std::vector<std::span<const Job>> groups_;
    std::size_t ahead_bytes_;
    bool resume_;
    std::function<bool()> stop_;
    std::mutex mutex_;
    std::condition_variable_any changed_;
    std::optional<LoadedMap> ready_;
    bool taker_waits_ = false;  ///< no map is in use
    bool finished_ = false;
    std::jthread thread_;  ///< last, so that it ends before what it uses
};

/// Throws InputError where the map is no longer the file that was planned with.
void check_unchanged(const PlannedMap& map);

}  // namespace clerestory
