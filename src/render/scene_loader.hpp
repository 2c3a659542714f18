#pragma once

#include <condition_variable>
#include <cstddef>
#include <filesystem>
#include <future>
#include <memory>
#include <mutex>
#include <optional>

#include "base/clock.hpp"
#include "image.hpp"
#include "render/scene.hpp"

namespace clerestory {

/// A map on its way to a scene. It is read from the start on, in a thread of its own, while its owner opens a device;
/// tables are built behind the reader, band by band, so that they are ready soon after the last row is decoded.
class SceneLoader {
  public:
    /// Starts reading. What goes wrong is told by `finish`.
    SceneLoader(std::filesystem::path file, ReadOptions read, SceneOptions options);
    SceneLoader(const SceneLoader&) = delete;
    SceneLoader& operator=(const SceneLoader&) = delete;
    /// Ends a reading that nobody has asked the scene of, after the band in hand.
    ~SceneLoader();

    /// The scene on a device, when all of it is read and built; once. Throws what read_map and Scene throw; messages
    /// name the file.
    std::unique_ptr<Scene> finish(const Device& device, TableBuilder& builder);

    /// Seconds from the start until the last rows were decoded; after `finish`.
    [[nodiscard]] double read_seconds() const noexcept { return read_seconds_; }

  private:
    bool wait_for_device();
    void add_rows(const RadianceMap& map, std::size_t begin, std::size_t end);

    const std::filesystem::path file_;
    const SceneOptions options_;
    const Stopwatch watch_;
    std::mutex mutex_;
    std::condition_variable changed_;
    const Device* device_ = nullptr;
    TableBuilder* builder_ = nullptr;
    bool abandoned_ = false;
    std::optional<BegunTables> begun_;
    double read_seconds_ = 0;
    std::future<RadianceMap> map_;  ///< last, because its thread uses the others
};

}  // namespace clerestory
