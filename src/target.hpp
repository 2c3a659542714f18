#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "cl/device.hpp"
#include "render.hpp"
#include "scene.hpp"

namespace clerestory {

/// A way to light the sphere that reaches an asked error, and what it was chosen over.
struct TargetChoice {
    RenderOptions method;      ///< what was asked for, with the chosen estimator, samples, degrees and lights
    double reached_error = 0;  ///< relative RMSE of this very picture, measured on a small one (see choose_method)
    std::string choice;        ///< as flags of `render`
    std::string why;           ///< a sentence
};

/// Picks the fastest way to light the sphere whose relative RMSE is at most `target_error` on this map: harmonics and
/// shared Sobol' samples with control variates of several degrees, or exact.
/// Candidates are held against `exact` on a picture of at most 63 x 63, with the same seed: the same samples light it,
/// so its error is that of the large picture at fewer of its pixels, and a tenth is kept in hand for those between.
/// Those that reach the target are then timed at the picture's own size.
///   asked  size, rotation, place in the texel and seed are taken from it
/// Throws UsageError where the target is not positive.
TargetChoice choose_method(const Device& device, const Scene& scene, const RenderOptions& asked, double target_error);

}  // namespace clerestory
