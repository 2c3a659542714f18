#include "render/scene_loader.hpp"

#include <fmt/format.h>

#include <exception>
#include <utility>

#include "error.hpp"

namespace clerestory {
namespace {

/// Ends a reading whose result nobody waits for; nobody sees it either.
struct Abandoned : std::exception {};

}  // namespace

SceneLoader::SceneLoader(std::filesystem::path file, ReadOptions read, SceneOptions options)
    : file_(std::move(file)), options_(options) {
    read.rows_ready = [this](const RadianceMap& map, std::size_t begin, std::size_t end) { add_rows(map, begin, end); };
    map_ = std::async(std::launch::async, [this, read = std::move(read)] { return read_map(file_, read); });
}

SceneLoader::~SceneLoader() {
    const std::lock_guard lock(mutex_);
    abandoned_ = true;
    changed_.notify_all();
}

/// False where no device will come.
bool SceneLoader::wait_for_device() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return abandoned_ || device_ != nullptr; });
    return !abandoned_;
}

/// In the reading thread, which waits for nothing but the rows of one band: the decoder goes on meanwhile.
void SceneLoader::add_rows(const RadianceMap& map, std::size_t begin, std::size_t end) {
    read_seconds_ = watch_.seconds();
    if (!wait_for_device()) throw Abandoned();
    // Repairs come before tables, and other devices take a copy of the whole map.
    if (options_.bad_texels == BadTexels::zero || !device_->traits().zero_copy) return;
    const Stopwatch building;
    if (!begun_) begun_ = {DeviceMap(*device_, map), builder_->start(map.width, map.height, options_.tables)};
    builder_->add_rows(begun_->tables, begun_->map, begin, end);
    begun_->seconds += building.seconds();
}

std::unique_ptr<Scene> SceneLoader::finish(const Device& device, TableBuilder& builder) {
    {
        const std::lock_guard lock(mutex_);
        device_ = &device;
        builder_ = &builder;
        changed_.notify_all();
    }
    RadianceMap map = map_.get();
    try {
        return std::make_unique<Scene>(device, builder, std::move(map), options_, std::move(begun_));
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", file_.string(), error.what()));
    }
}

}  // namespace clerestory
