#include "base/statistics.hpp"

#include <algorithm>
#include <cmath>

namespace clerestory {

namespace {

template <class Real>
double root_mean_square_of(std::span<const Real> values) {
    double squares = 0;
    for (const Real value : values) squares += static_cast<double>(value) * static_cast<double>(value);
    return values.empty() ? 0 : std::sqrt(squares / static_cast<double>(values.size()));
}

}  // namespace

Spread spread_of(std::span<const double> values) {
    Spread spread;
    if (values.empty()) return spread;
    const auto n = static_cast<double>(values.size());
    for (const double value : values) spread.mean += value / n;
    if (values.size() == 1) return spread;
    double squares = 0;
    for (const double value : values) squares += (value - spread.mean) * (value - spread.mean);
    spread.deviation = std::sqrt(squares / (n - 1));
    spread.standard_error = spread.deviation / std::sqrt(n);
    return spread;
}

double root_mean_square(std::span<const double> values) { return root_mean_square_of(values); }
double root_mean_square(std::span<const float> values) { return root_mean_square_of(values); }

double student_95(std::size_t degrees_of_freedom) {
    constexpr double Z = 1.959963984540054;  // the normal distribution's
    const auto v = static_cast<double>(degrees_of_freedom);
    const double z2 = Z * Z;
    const double first = Z * (z2 + 1) / 4;
    const double second = Z * ((5 * z2 + 16) * z2 + 3) / 96;
    const double third = Z * (((3 * z2 + 19) * z2 + 17) * z2 - 15) / 384;
    const double fourth = Z * ((((79 * z2 + 776) * z2 + 1482) * z2 - 1920) * z2 - 945) / 92160;
    return Z + (first + (second + (third + fourth / v) / v) / v) / v;
}

PowerLaw fit_power_law(std::span<const double> x, std::span<const double> y) {
    std::vector<double> u;
    std::vector<double> v;
    for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) {
        if (!(x[i] > 0) || !(y[i] > 0)) continue;
        u.push_back(std::log(x[i]));
        v.push_back(std::log(y[i]));
    }
    PowerLaw law;
    law.points = u.size();
    if (law.points < 3) return law;
    const double mean_u = spread_of(u).mean;
    const double mean_v = spread_of(v).mean;
    double uu = 0;
    double uv = 0;
    for (std::size_t i = 0; i < u.size(); ++i) {
        uu += (u[i] - mean_u) * (u[i] - mean_u);
        uv += (u[i] - mean_u) * (v[i] - mean_v);
    }
    if (uu == 0) return law;
    law.slope = uv / uu;
    law.factor = std::exp(mean_v - law.slope * mean_u);
    double left = 0;
    for (std::size_t i = 0; i < u.size(); ++i) {
        const double residual = v[i] - mean_v - law.slope * (u[i] - mean_u);
        left += residual * residual;
    }
    const std::size_t freedom = law.points - 2;
    law.half_width = student_95(freedom) * std::sqrt(left / static_cast<double>(freedom) / uu);
    return law;
}

double quantile(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    const auto last = static_cast<double>(values.size() - 1);
    const auto at = static_cast<std::size_t>(std::lround(std::clamp(share, 0.0, 1.0) * last));
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
    return values[at];
}

}  // namespace clerestory
