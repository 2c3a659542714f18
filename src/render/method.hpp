#pragma once

#include <string>

#include "options.hpp"

namespace clerestory {

/// Whether an estimator draws samples, and so has a sequence and a seed.
bool draws_samples(Estimator estimator);

/// A way to light the sphere in words, such as "shared sobol, N = 1024, L = 8".
std::string method_name(const RenderOptions& method);
/// The same as flags of `render`.
std::string method_flags(const RenderOptions& method);

}  // namespace clerestory
