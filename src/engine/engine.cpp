#include "engine.hpp"

#include <fmt/format.h>

#include <cstring>
#include <utility>

#include "engine/engine_state.hpp"
#include "error.hpp"
#include "measure/choose_estimator.hpp"
#include "picture/picture_file.hpp"
#include "render/picture_limits.hpp"
#include "sampling/sample_records.hpp"
#include "sampling/stage3_sample.hpp"

namespace clerestory {
namespace {

std::vector<unsigned char> rgba_bytes(const std::vector<cl_uint>& pixels) {
    std::vector<unsigned char> bytes(pixels.size() * sizeof(cl_uint));
    std::memcpy(bytes.data(), pixels.data(), bytes.size());
    return bytes;
}

void check_whole(const Rendered& picture) {
    if (picture.size == 0 || picture.size > limits::LARGEST_SIDE ||
        picture.rgba.size() != 4 * picture.size * picture.size) {
        throw UsageError(
            fmt::format("a picture of size {} with {} values: it has four a pixel", picture.size, picture.rgba.size()));
    }
}

}  // namespace

const RadianceMap& EnvironmentMap::map() const noexcept { return state_->scene.map(); }
double EnvironmentMap::phi() const noexcept { return state_->scene.distribution().phi; }
bool EnvironmentMap::black() const noexcept { return state_->scene.distribution().black(); }
std::size_t EnvironmentMap::repaired() const noexcept { return state_->scene.repaired(); }
double EnvironmentMap::build_seconds() const noexcept { return state_->scene.build_seconds(); }

std::size_t Samples::count() const noexcept { return state_->set.count; }

std::vector<SampleRecord> Samples::records() const {
    return sample_records(state_->set, state_->environment.state().scene.distribution());
}

Engine::Engine(const DeviceOptions& options) : state_(std::make_shared<State>(options)) {}

void Engine::check_own(const EnvironmentMap& environment) const {
    if (environment.state().device == state_->device) return;
    throw UsageError("an environment belongs to the engine that made it, and another cannot use it");
}

const DeviceInfo& Engine::device() const noexcept { return state_->device->info(); }

EnvironmentMap Engine::environment(RadianceMap map, const EnvironmentOptions& options) {
    constexpr ReadLimits LIMITS;
    const bool within = map.width <= LIMITS.max_side && map.height <= LIMITS.max_side;
    const std::size_t texels = within ? map.width * map.height : 0;
    if (texels == 0 || texels > LIMITS.max_texels || map.rgb.size() != 3 * texels) {
        throw UsageError(
            fmt::format("a map of {} x {} texels with {} values: it has three a texel, and at most {} texels",
                        map.width, map.height, map.rgb.size(), LIMITS.max_texels));
    }
    SceneOptions scene;
    scene.tables.luminance = options.luminance;
    scene.bad_texels = options.bad_texels;
    return EnvironmentMap(
        std::make_shared<const EnvironmentMap::State>(state_->device, state_->builder, std::move(map), scene));
}

Samples Engine::draw(const EnvironmentMap& environment, std::size_t count, const SamplingOptions& options) {
    check_own(environment);
    limits::check(RenderOptions{.samples = count, .sampling = options});
    auto& drawing = state_->drawing;
    if (!drawing || &drawing->environment.state() != &environment.state() || !(drawing->options == options)) {
        const Scene& scene = environment.state().scene;
        drawing.reset();
        drawing.emplace(Engine::State::Drawing{
            environment, options, Sampler(*state_->device, scene.device_map(), scene.distribution(), options)});
    }
    return Samples(std::make_shared<const Samples::State>(Samples::State{environment, drawing->sampler.draw(count)}));
}

Rendered Engine::render(const EnvironmentMap& environment, const RenderOptions& options,
                        const ProgressFunction& progress) {
    check_own(environment);
    limits::check(options);
    return state_->renderer.render(environment.state().scene, options, progress);
}

TargetChoice Engine::choose(const EnvironmentMap& environment, const RenderOptions& asked, double target_error) {
    check_own(environment);
    limits::check(asked);
    return choose_estimator(state_->renderer, environment.state().scene, asked, target_error);
}

std::vector<unsigned char> Engine::preview(const Rendered& picture, const ToneOptions& tone) {
    check_whole(picture);
    limits::check(tone);
    return rgba_bytes(state_->renderer.display().preview(picture.rgba, 4, tone));
}

std::vector<unsigned char> Engine::marked_map(const EnvironmentMap& environment, const Samples& samples, double scale,
                                              const ToneOptions& tone) {
    check_own(environment);
    check_own(samples.state().environment);
    limits::check(RenderOptions{.scale = scale});
    limits::check(tone);
    if (&samples.state().environment.state() != &environment.state()) {
        throw UsageError("samples of one environment cannot be marked on another");
    }
    return rgba_bytes(
        state_->renderer.display().marked_preview(environment.map(), scale, tone, samples.state().set.texel));
}

void Engine::write(const std::filesystem::path& file, const Rendered& picture, const ToneOptions& tone,
                   const Header& header) {
    check_whole(picture);
    limits::check(tone);
    write_picture(file.string(), picture, tone, state_->renderer.display(), header);
}

}  // namespace clerestory
