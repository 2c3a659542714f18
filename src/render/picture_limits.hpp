#pragma once

#include <cstddef>

#include "options.hpp"

/// The ranges that a picture's parameters are accepted in: at the command line, in job files and by the library.
namespace clerestory::limits {

/// A rotation of more turns than this loses the angle's own digits.
inline constexpr double LARGEST_ROTATION_DEG = 1e6;
inline constexpr double LARGEST_SCALE = 1e30;
inline constexpr double LARGEST_EXPOSURE = 1e30;
inline constexpr double LARGEST_GAMMA = 100;
inline constexpr double LARGEST_ALBEDO = 1e6;
inline constexpr std::size_t LARGEST_COUNT = std::size_t{1} << 30;
inline constexpr std::size_t LARGEST_SIDE = 16384;
inline constexpr int LARGEST_PART = 1 << 20;

/// Throw UsageError, naming the option, where a value is out of its range or no number.
void check(const SamplingOptions& options);
void check(const RenderOptions& options);
void check(const ToneOptions& options);

}  // namespace clerestory::limits
