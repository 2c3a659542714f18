#pragma once

#include <memory>
#include <optional>

#include "cl/device.hpp"
#include "engine.hpp"
#include "render/known_answers.hpp"
#include "render/renderer.hpp"
#include "render/scene.hpp"
#include "sampling/stage3_sample.hpp"

/// What stands behind the public interface (include/clerestory/engine.hpp).
namespace clerestory {

struct EnvironmentMap::State {
    State(std::shared_ptr<const Device> opened, TableBuilder& builder, RadianceMap map, const SceneOptions& options)
        : device(std::move(opened)), scene(*device, builder, std::move(map), options) {}

    std::shared_ptr<const Device> device;  ///< outlives the scene's memory on it
    Scene scene;
};

struct Samples::State {
    EnvironmentMap environment;
    SampleSet set;
};

struct Engine::State {
    explicit State(const DeviceOptions& options)
        : device(std::make_shared<const Device>(open_device(options))), builder(*device), renderer(*device) {}

    std::shared_ptr<const Device> device;
    TableBuilder builder;
    Renderer renderer;

    /// The sampler of the last draw: sets of several sizes are drawn by one.
    struct Drawing {
        EnvironmentMap environment;
        SamplingOptions options;
        Sampler sampler;
    };
    std::optional<Drawing> drawing;
};

}  // namespace clerestory
