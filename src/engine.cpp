#include "engine.hpp"

#include <fmt/format.h>

#include <cstring>
#include <utility>

#include "clock.hpp"
#include "engine_state.hpp"
#include "error.hpp"
#include "picture_file.hpp"
#include "sample_report.hpp"
#include "table_arithmetic.hpp"
#include "target.hpp"

namespace clerestory {
namespace {

std::vector<unsigned char> rgba_bytes(const std::vector<cl_uint>& pixels) {
    std::vector<unsigned char> bytes(pixels.size() * sizeof(cl_uint));
    std::memcpy(bytes.data(), pixels.data(), bytes.size());
    return bytes;
}

}  // namespace

const RadianceMap& Environment::map() const noexcept { return state_->scene.map(); }
double Environment::phi() const noexcept { return state_->scene.distribution().phi; }
bool Environment::black() const noexcept { return state_->scene.distribution().black(); }
std::size_t Environment::repaired() const noexcept { return state_->scene.repaired(); }
double Environment::build_seconds() const noexcept { return state_->scene.build_seconds(); }

std::size_t Samples::count() const noexcept { return state_->set.count; }

std::vector<SampleRecord> Samples::records() const {
    return sample_records(state_->set, state_->environment.state().scene.distribution());
}

Engine::Engine(const DeviceOptions& options) : state_(std::make_shared<State>(options)) {}

const DeviceInfo& Engine::device() const noexcept { return state_->device->info(); }

Environment Engine::environment(RadianceMap map, const EnvironmentOptions& options) {
    SceneOptions scene;
    scene.tables.luminance = options.luminance;
    scene.bad_texels = options.bad_texels;
    return Environment(std::make_shared<const Environment::State>(state_->device, state_->builder, std::move(map),
                                                                  scene, options.luminance));
}

Samples Engine::draw(const Environment& environment, std::size_t count, const SamplingOptions& options) {
    constexpr std::size_t LARGEST_COUNT = std::size_t{1} << 30;
    if (count == 0 || count > LARGEST_COUNT) {
        throw UsageError(fmt::format("{} samples: draw 1 to {} at a time", count, LARGEST_COUNT));
    }
    auto& drawing = state_->drawing;
    if (!drawing || &drawing->environment.state() != &environment.state() || !(drawing->options == options)) {
        const Scene& scene = environment.state().scene;
        drawing.reset();
        drawing.emplace(Engine::State::Drawing{
            environment, options, Sampler(*state_->device, scene.device_map(), scene.distribution(), options)});
    }
    return Samples(std::make_shared<const Samples::State>(Samples::State{environment, drawing->sampler.draw(count)}));
}

Rendered Engine::render(const Environment& environment, const RenderOptions& options,
                        const ProgressFunction& progress) {
    return state_->renderer.render(environment.state().scene, options, progress);
}

TargetChoice Engine::choose(const Environment& environment, const RenderOptions& asked, double target_error) {
    return choose_method(*state_->device, environment.state().scene, asked, target_error);
}

TableFacts Engine::measure_tables(const Environment& environment) {
    const auto& [device, scene, luminance] = environment.state();
    TableFacts facts;
    Distribution again = state_->builder.build(scene.device_map(), {.luminance = luminance});
    const Stopwatch watch;
    again = state_->builder.build(scene.device_map(), {.luminance = luminance}, std::move(again));
    facts.build_seconds = watch.seconds();
    facts.undrawable_f32 = undrawable_f32(*device, scene.device_map(), luminance);
    return facts;
}

std::vector<unsigned char> Engine::preview(const Rendered& picture, const ToneOptions& tone) {
    return rgba_bytes(state_->renderer.display().preview(picture.rgba, 4, tone));
}

std::vector<unsigned char> Engine::marked_map(const Environment& environment, const Samples& samples, double scale,
                                              const ToneOptions& tone) {
    return rgba_bytes(
        state_->renderer.display().marked_preview(environment.map(), scale, tone, samples.state().set.texel));
}

void Engine::write(const std::filesystem::path& file, const Rendered& picture, const ToneOptions& tone,
                   const Header& header) {
    write_picture(file.string(), picture, tone, state_->renderer.display(), header);
}

}  // namespace clerestory
