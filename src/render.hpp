#pragma once

#include <memory>

#include "cl/device.hpp"
#include "engine.hpp"
#include "options.hpp"
#include "scene.hpp"
#include "sphere.hpp"

namespace clerestory {

/// Renders pictures on one device; kernels are compiled when first needed and kept, and so is what the last scene's
/// pictures share (samplers, harmonic series), whatever their rotations and seeds.
class Renderer {
  public:
    explicit Renderer(const Device& device);
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;
    ~Renderer();

    /// A black map gives a black sphere.
    Rendered render(const Scene& scene, const RenderOptions& options, const ProgressFunction& progress = {});

    [[nodiscard]] Display& display();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clerestory
