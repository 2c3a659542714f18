#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace clerestory {

/// A mean with its spread.
struct Spread {
    double mean = 0;
    double deviation = 0;       ///< standard deviation of one value, n - 1 in the denominator
    double standard_error = 0;  ///< of the mean
};
Spread spread_of(std::span<const double> values);

/// y = factor x^slope, by least squares on logarithms.
struct PowerLaw {
    double slope = 0;
    double half_width = 0;  ///< of the slope's 95 % confidence interval, by Student's t
    double factor = 0;
    std::size_t points = 0;
};
/// Points with x or y that are not positive are left out; needs three points and two different x.
PowerLaw fit_power_law(std::span<const double> x, std::span<const double> y);

double root_mean_square(std::span<const double> values);
double root_mean_square(std::span<const float> values);

/// The value that Student's t stays below in size with probability 95 %.
/// Error: below 0.5 % from 3 degrees of freedom on. Source: Abramowitz and Stegun, 26.7.5.
double student_95(std::size_t degrees_of_freedom);

/// The value below which `share` of the values lie; sorts them.
double quantile(std::vector<double> values, double share);

}  // namespace clerestory
