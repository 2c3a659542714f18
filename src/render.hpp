#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cl/device.hpp"
#include "harmonic.hpp"
#include "samples.hpp"
#include "scene.hpp"
#include "sphere.hpp"

namespace clerestory {

/// How the light that a pixel receives is computed.
enum class Estimator {
    shared,     ///< one sample set for every pixel
    per_pixel,  ///< a fresh set for every pixel
    exact,      ///< the integral itself; needs no samples
    harmonic,   ///< spherical harmonics and the brightest texels as lights; needs no samples
};

/// Every estimator's name at the command line.
std::vector<std::string> estimator_names();
/// The name of an estimator at the command line, and back. Throws UsageError.
std::string estimator_name(Estimator estimator);
Estimator estimator_by_name(const std::string& name);

/// One picture of the sphere.
struct RenderOptions {
    Estimator estimator = Estimator::shared;
    std::size_t samples = 1024;
    std::size_t size = 511;  ///< pixels of a side
    double albedo = 1;
    double scale = 1;  ///< multiplies the environment
    SamplingOptions sampling;
    HarmonicOptions harmonic;
};

/// Seconds by stage, in the order of work.
using StageSeconds = std::vector<std::pair<std::string, double>>;

struct Rendered {
    std::size_t size = 0;
    std::vector<float> rgba;  ///< [4 * size * size], alpha 0 beside the sphere
    StageSeconds seconds;
};

/// Called now and then with how much of the work is done.
using ProgressFunction = std::function<void(double done, double total)>;

/// Renders pictures on one device; kernels are compiled when first needed and kept.
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
