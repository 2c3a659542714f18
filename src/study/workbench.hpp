#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "cl/device.hpp"
#include "render.hpp"
#include "scene.hpp"

namespace clerestory {

/// A way to light the sphere in words, such as "shared sobol, N = 1024, L = 8".
std::string method_name(const RenderOptions& method);
/// The same as flags of `render`.
std::string method_flags(const RenderOptions& method);

/// Seconds of one picture by stage, kernels compiled and warm, tables built.
struct MethodTimes {
    double project = 0;  ///< the map's harmonic series, where the method has one
    double draw = 0;     ///< samples shared by all pixels; `per-pixel` draws while it shades
    double shade = 0;
    [[nodiscard]] double total() const noexcept { return project + draw + shade; }
};

struct MethodRun {
    MethodTimes times;
    std::vector<float> errors;  ///< [3 * pixels], planes R, G, B: picture less exact, over the exact picture's mean
};

/// Root mean square of errors over pixels and channels.
double relative_rmse(const std::vector<float>& values);

/// Lights one sphere by any method, times it, and holds it against the exact picture. Kernels, shaders and exact
/// pictures are made once.
class Workbench {
  public:
    /// The device and the scene must outlive it.
    Workbench(const Device& device, const Scene& scene);
    Workbench(Workbench&&) noexcept;
    Workbench& operator=(Workbench&&) noexcept;
    ~Workbench();

    /// Mean of the exact picture of this size and rotation over pixels and channels, times 2^-exponent; 0 where no
    /// light reaches what is seen of the sphere. Integrates it when first asked.
    double exact_mean(const RenderOptions& method);
    /// Times of that integration, its kernels compiled before.
    MethodTimes exact_times(const RenderOptions& method);

    /// One picture's errors and times. A method of a kind that has not run yet runs twice, the first time to warm up.
    /// Throws InputError where exact_mean is 0.
    ///   method  `scale` and `albedo` are not used: a relative error has neither
    MethodRun run(const RenderOptions& method);

    /// Times alone; the exact picture is not needed.
    MethodTimes time(const RenderOptions& method);

    /// Values a pixel of the picture, the mean over channels; NaN beside the sphere.
    ///   returns [size * size]
    std::vector<float> as_picture(const RenderOptions& method, const std::vector<float>& errors);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clerestory
