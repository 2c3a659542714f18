#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "render/renderer.hpp"
#include "shading/pixels.hpp"

namespace clerestory {

/// Seconds of one picture by stage, kernels compiled and warm, tables built.
struct MethodTimes {
    double project = 0;  ///< the map's harmonic series, where the method has one
    double draw = 0;     ///< samples shared by all pixels; `per-pixel` draws while it shades
    double shade = 0;
    [[nodiscard]] double total() const noexcept { return project + draw + shade; }
};

/// The errors of one picture of the sphere against the exact one, in parts of the exact picture's mean.
///   [3 * pixels]  planes R, G, B over the sphere's pixels
using ErrorPlanes = std::vector<float>;

struct MethodRun {
    MethodTimes times;
    ErrorPlanes errors;
};

/// What every picture of one size and rotation is held against, for albedo 1 and in the map's scale 2^-exponent.
struct ExactPicture {
    Buffer<cl_float> light;        ///< as SphereView::planes
    std::vector<cl_float> planes;  ///< [3 * stride], the same on the host
    double mean = 0;               ///< over pixels and channels; 0 where no light reaches what is seen of the sphere
    MethodTimes times;             ///< its kernels compiled before
};

/// Lights one scene's sphere by any method, times it, and holds it against the exact picture. Shaders and exact
/// pictures are made once.
class ErrorMeter {
  public:
    /// The renderer and the scene must outlive it.
    ErrorMeter(Renderer& renderer, const Scene& scene);
    ErrorMeter(ErrorMeter&&) noexcept;
    ErrorMeter& operator=(ErrorMeter&&) noexcept;
    ~ErrorMeter();

    /// The pixels of pictures of this size.
    const SphereView& view(std::size_t size);

    /// The exact picture of the method's size and rotation, integrated when first asked for.
    const ExactPicture& exact(const RenderOptions& method, const ProgressFunction& progress = {});
    /// The same where an error has a meaning: throws InputError where its mean is 0.
    const ExactPicture& lit_exact(const RenderOptions& method, const ProgressFunction& progress = {});

    /// One picture's errors and times. A method of a kind that has not run yet runs twice, the first time to warm up.
    /// Throws InputError where the exact mean is 0.
    ///   method  `scale` and `albedo` are not used: a relative error has neither
    MethodRun run(const RenderOptions& method);
    /// Times alone; the exact picture is not needed.
    MethodTimes time(const RenderOptions& method);

    /// Errors of a picture that stands already. Throws InputError where the exact mean is 0.
    ///   method  its size and rotation
    ///   rgba    [4 * size * size]
    ///   gain    its albedo times its scale
    ErrorPlanes errors_of_picture(const RenderOptions& method, const std::vector<float>& rgba, double gain);

    /// Values of the exact picture over pixels and channels, in the map's radiance.
    std::vector<double> exact_values(const RenderOptions& method);
    /// The exposure, to three digits, at which the exact picture's bright end (all but one value in 200) is at 95 % of
    /// white in a preview of this gamma.
    ///   gain  the preview's albedo times its scale
    double bright_exposure(const RenderOptions& method, double gain, double gamma);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clerestory
