#pragma once

#include "engine.hpp"
#include "options.hpp"
#include "render/renderer.hpp"

namespace clerestory {

/// Picks the fastest way to light the sphere whose relative RMSE is at most `target_error` on this map: harmonics and
/// shared Sobol' samples with control variates of several degrees, or exact.
/// Candidates are held against `exact` on a picture of at most 63 x 63, with the same seed: the same samples light it,
/// so its error is that of the large picture at fewer of its pixels, and a tenth is kept in hand for those between.
/// Those that reach the target are then timed at the picture's own size.
///   asked  size, rotation, place in the texel and seed are taken from it
/// Throws UsageError where the target is not positive.
TargetChoice choose_estimator(Renderer& renderer, const Scene& scene, const RenderOptions& asked, double target_error);

}  // namespace clerestory
