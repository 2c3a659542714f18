#pragma once

#include <memory>

#include "cl/buffer.hpp"
#include "cl/device.hpp"
#include "engine.hpp"
#include "options.hpp"
#include "render/scene.hpp"
#include "shading/display.hpp"
#include "shading/harmonic.hpp"
#include "shading/pixels.hpp"

namespace clerestory {

/// Lights spheres by every estimator on one device; the one place where they are told apart. Kernels are compiled when
/// first needed and kept, and so is what the pictures of one scene share (samplers, harmonic series), whatever their
/// rotations and seeds.
class Renderer {
  public:
    explicit Renderer(const Device& device);
    Renderer(Renderer&&) noexcept;
    Renderer& operator=(Renderer&&) noexcept;
    ~Renderer();

    /// A black map gives a black sphere.
    Rendered render(const Scene& scene, const RenderOptions& options, const ProgressFunction& progress = {});

    /// The light on each pixel, for albedo 1 and in the map's scale 2^-exponent; done when it returns. Throws
    /// InputError where an estimator that samples meets a black map.
    ///   unit_albedo_radiance    as SphereView::planes
    ///   returns  seconds: kernels, project, draw, shade, those that the estimator has
    StageSeconds shade(const Scene& scene, const RenderOptions& options, const SphereView& view,
                       Buffer<cl_float>& unit_albedo_radiance, const ProgressFunction& progress = {});

    /// The map's harmonic series and lights, projected when first asked for.
    const ProjectedMap& projection(const Scene& scene, const HarmonicOptions& options);
    /// Projects anew when next asked: for who times that.
    void forget_projection(const HarmonicOptions& options) noexcept;

    [[nodiscard]] const Device& device() const noexcept;
    [[nodiscard]] Display& display();

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clerestory
