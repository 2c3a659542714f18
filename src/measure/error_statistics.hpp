#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "measure/error_meter.hpp"
#include "shading/pixels.hpp"

namespace clerestory {

/// What one picture's error is made of; all in parts of the exact picture's mean.
struct ErrorParts {
    double rel_rmse = 0;
    double rel_bias = 0;  ///< mean over pixels and channels
    /// Mean product of the errors of pixels side by side over the mean square: 1 where neighbours err together, 0 where
    /// they err on their own.
    double neighbour_correlation = 0;
    std::vector<double> block_rms;  ///< as ErrorStatistics::block_rms
};

/// Errors of one method over several seeds.
struct SeedErrors {
    RenderOptions method;           ///< with the first seed
    std::vector<double> rel_rmse;   ///< [seeds]
    std::vector<double> rel_bias;   ///< [seeds]
    std::vector<double> block_rms;  ///< [block sides], root mean square over pixels and seeds
    double mean_rms = 0;            ///< of the mean over seeds, over pixels: bias, and what noise the mean still has
    double spread_rms = 0;          ///< of the standard deviation over seeds
    double seconds = 0;             ///< of one picture's drawing and shading, mean over seeds
    ErrorPlanes mean;               ///< over seeds
    ErrorPlanes spread;             ///< standard deviation over seeds
};

/// Numbers and pictures of errors over the sphere's pixels.
class ErrorStatistics {
  public:
    explicit ErrorStatistics(const SphereView& view);

    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    [[nodiscard]] std::size_t pixels() const noexcept { return pixel_.size(); }

    [[nodiscard]] ErrorParts parts_of(const ErrorPlanes& errors) const;

    /// Sides of the squares over which errors are averaged: powers of two from 1.
    [[nodiscard]] const std::vector<std::size_t>& block_sides() const noexcept { return sides_; }
    /// Root mean square of the errors' means over squares of each side; over the same pixels for all of them.
    [[nodiscard]] std::vector<double> block_rms(const ErrorPlanes& errors) const;

    /// A value a pixel of the picture: the mean of the three planes; NaN beside the sphere.
    ///   returns [size * size]
    [[nodiscard]] std::vector<float> as_picture(const ErrorPlanes& planes) const;

  private:
    void find_blocked();
    [[nodiscard]] std::vector<double> blocked_plane(const ErrorPlanes& errors, std::size_t plane) const;
    [[nodiscard]] double neighbour_correlation(const ErrorPlanes& errors) const;

    std::size_t size_;
    std::vector<cl_uint> pixel_;        ///< [pixels], row * size + column
    std::vector<std::size_t> sides_;    ///< of blocks
    std::vector<std::size_t> blocked_;  ///< pixels in whole squares of the largest side, as places in the planes
    std::vector<std::pair<std::size_t, std::size_t>> neighbours_;  ///< places of pixels side by side in a row
};

/// Errors of a method with seeds from its own on; `count` is at least 2.
SeedErrors errors_over_seeds(ErrorMeter& meter, const ErrorStatistics& statistics, const RenderOptions& method,
                             std::size_t count, const ProgressFunction& progress = {});

}  // namespace clerestory
