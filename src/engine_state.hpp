#pragma once

#include <memory>
#include <optional>

#include "cl/device.hpp"
#include "engine.hpp"
#include "known_answers.hpp"
#include "render.hpp"
#include "samples.hpp"
#include "scene.hpp"

/// What stands behind the public interface (include/clerestory/engine.hpp), for commands that reach further than it.
namespace clerestory {

struct Environment::State {
    State(std::shared_ptr<const Device> opened, TableBuilder& builder, RadianceMap map, const SceneOptions& options,
          Luminance chosen)
        : device(std::move(opened)), scene(*device, builder, std::move(map), options), luminance(chosen) {}

    std::shared_ptr<const Device> device;  ///< outlives the scene's memory on it
    Scene scene;
    Luminance luminance;
};

struct Samples::State {
    Environment environment;
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
        Environment environment;
        SamplingOptions options;
        Sampler sampler;
    };
    std::optional<Drawing> drawing;
};

}  // namespace clerestory
