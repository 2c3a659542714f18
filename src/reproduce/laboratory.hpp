#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "cl/device.hpp"
#include "render.hpp"
#include "scene.hpp"
#include "sphere.hpp"

namespace clerestory {

/// The error of one picture of the sphere against the exact one, in parts of the exact picture's mean.
///   values [3 * pixels]  planes R, G, B over the sphere's pixels
using ErrorPlanes = std::vector<float>;

/// What one picture's error is made of; all in parts of the exact picture's mean.
struct ErrorParts {
    double rel_rmse = 0;
    double rel_bias = 0;  ///< mean over pixels and channels
    /// Mean product of the errors of pixels side by side over the mean square: 1 where neighbours err together, 0 where
    /// they err on their own.
    double neighbour_correlation = 0;
    std::vector<double> block_rms;  ///< as Laboratory::block_rms
};

/// Errors of one estimator at one number of samples, over several seeds.
struct SeedStudy {
    Estimator estimator = Estimator::shared;
    unsigned control_degree = 0;
    std::size_t samples = 0;
    std::vector<double> rel_rmse;   ///< [seeds]
    std::vector<double> rel_bias;   ///< [seeds]
    std::vector<double> block_rms;  ///< [block sides], root mean square over pixels and seeds
    double mean_rms = 0;            ///< of the mean over seeds, over pixels: bias, and what noise the mean still has
    double spread_rms = 0;          ///< of the standard deviation over seeds
    double seconds = 0;             ///< of one picture's drawing and shading, mean over seeds
    ErrorPlanes mean;               ///< over seeds
    ErrorPlanes spread;             ///< standard deviation over seeds
};

/// How pictures of a study are made.
struct StudySubject {
    Estimator estimator = Estimator::shared;
    unsigned control_degree = 0;
    std::size_t samples = 0;
};

/// One sphere under one map: pictures by any estimator, the exact one, and errors between them. Kernels, tables and
/// shaders are made once.
class Laboratory {
  public:
    /// The device and the scene must outlive it. Throws InputError where no light reaches what is seen of the sphere.
    Laboratory(const Device& device, const Scene& scene, std::size_t size, double rotate_y_deg,
               const ProgressFunction& progress = {});
    Laboratory(Laboratory&&) noexcept;
    Laboratory& operator=(Laboratory&&) noexcept;
    ~Laboratory();

    [[nodiscard]] std::size_t size() const noexcept;
    [[nodiscard]] std::size_t pixels() const noexcept;
    /// The exact picture, in the map's radiance times albedo 1.
    ///   [4 * size * size]  RGBA, alpha 0 beside the sphere
    [[nodiscard]] std::vector<float> exact_picture(Display& display, double gain) const;
    [[nodiscard]] double exact_seconds() const noexcept;
    /// Values of the exact picture over pixels and channels, in the map's radiance.
    [[nodiscard]] std::vector<double> exact_values() const;
    [[nodiscard]] double exact_mean() const noexcept;
    /// The exposure, to three digits, at which the exact picture's bright end (all but one value in 200) is at 95 % of
    /// white in a preview of this gamma.
    [[nodiscard]] double bright_exposure(double gain, double gamma) const;

    /// One picture's errors, and the seconds that its drawing and shading took.
    std::pair<ErrorPlanes, double> error_of(const StudySubject& subject, std::uint64_t seed);
    /// The same for a picture of this sphere that stands already, rendered with this gain.
    ///   rgba [4 * size * size]
    [[nodiscard]] ErrorPlanes errors_of_picture(const std::vector<float>& rgba, double gain) const;
    [[nodiscard]] ErrorParts parts_of(const ErrorPlanes& errors) const;
    /// Errors over seeds first .. first + count - 1, which must be at least 2.
    SeedStudy study(const StudySubject& subject, std::uint64_t first, std::size_t count,
                    const ProgressFunction& progress = {});

    /// Sides of the squares over which errors are averaged: powers of two from 1.
    [[nodiscard]] const std::vector<std::size_t>& block_sides() const noexcept;
    /// Root mean square of the errors' means over squares of each side; over the same pixels for all of them.
    [[nodiscard]] std::vector<double> block_rms(const ErrorPlanes& errors) const;

    /// A value a pixel of the picture: the mean of the three planes; NaN beside the sphere.
    ///   returns [size * size]
    [[nodiscard]] std::vector<float> as_picture(const ErrorPlanes& planes) const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clerestory
