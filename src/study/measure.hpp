#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "measure/error_meter.hpp"
#include "render/renderer.hpp"
#include "tables/table_arithmetic.hpp"

namespace clerestory {

struct StudyOptions {
    RenderOptions base;           ///< size, rotation, place in the texel and first seed of all points
    std::size_t seeds = 16;       ///< most seeds of a point
    double budget_seconds = 100;  ///< for measuring; cheap points come first
};

/// A value's middle and the quarters around it.
struct Quartiles {
    double median = 0, low = 0, high = 0;
};
Quartiles quartiles_of(std::vector<double> values);

/// One way to light the sphere, measured. Errors are in parts of the exact picture's mean.
struct StudyPoint {
    RenderOptions method;
    std::size_t seeds = 0;          ///< pictures taken; 1 where the method has no seed
    double rel_rmse = 0;            ///< root mean square over pixels, channels and seeds
    double rel_rmse_deviation = 0;  ///< standard deviation of one seed's relative RMSE
    /// Root mean square over pixels of the mean over seeds, and what it would be without any bias, from the spread over
    /// seeds. Their ratio is near 1 where there is no bias.
    double bias = 0, bias_noise = 0;
    double worst = 0;         ///< largest error of any pixel, channel and seed
    double percentile99 = 0;  ///< that 99 of 100 errors stay below in size, mean over seeds
    Quartiles seconds;        ///< of one picture
    MethodTimes stages;       ///< medians
    bool on_front = false;    ///< no other point is both faster and nearer to the exact picture
};

/// The same map's tables in one arithmetic, built several times.
struct StudyTable {
    ArithmeticReport report;
    Quartiles seconds;
};

struct StudyMeasurements {
    std::vector<StudyPoint> points;       ///< sorted by method
    std::vector<RenderOptions> left_out;  ///< for which there was no time
    std::size_t short_of_seeds = 0;       ///< points that took fewer seeds than asked
    std::vector<StudyTable> tables;
    double seconds = 0;
};

/// Every point of a study but the exact picture: estimators, sequences, numbers of samples, degrees and lights. What
/// matters most comes first.
std::vector<RenderOptions> study_grid(const RenderOptions& base);

/// Measures the grid within the budget. Throws InputError where no light reaches what is seen of the sphere.
StudyMeasurements measure_study(ErrorMeter& meter, const StudyOptions& options, const ProgressFunction& progress = {});

/// Tables of the map in each arithmetic that the device has.
std::vector<StudyTable> measure_tables(const Device& device, const Scene& scene, Luminance luminance);

}  // namespace clerestory
