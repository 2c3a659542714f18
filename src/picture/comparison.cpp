#include "comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "error.hpp"

namespace clerestory {
namespace {

/// The picture shows this pixel: by its alpha, or by the unit disc where it has none.
bool shows(const Picture& picture, std::size_t row, std::size_t column) {
    if (!picture.alpha.empty()) return picture.alpha[row * picture.width + column] > 0;
    const double x = 2 * (static_cast<double>(column) + 0.5) / static_cast<double>(picture.width) - 1;
    const double y = 1 - 2 * (static_cast<double>(row) + 0.5) / static_cast<double>(picture.height);
    return x * x + y * y < 1;
}

double over(double value, double mean) {
    if (value == 0) return 0;
    return mean == 0 ? std::copysign(std::numeric_limits<double>::infinity(), value) : value / mean;
}

}  // namespace

Comparison compare(const Picture& a, const Picture& b) {
    if (a.width != b.width || a.height != b.height) {
        throw InputError(
            fmt::format("the pictures differ in size: {}x{} and {}x{}", a.width, a.height, b.width, b.height));
    }
    Comparison result;
    double squares = 0;
    double sum = 0;
    double reference_sum = 0;
    double reference_max = 0;
    for (std::size_t i = 0; i < a.height; ++i) {
        for (std::size_t j = 0; j < a.width; ++j) {
            if (!shows(a, i, j) || !shows(b, i, j)) continue;
            ++result.pixels;
            for (std::size_t c = 0; c < 3; ++c) {
                const auto value = static_cast<double>(a.rgb[3 * (i * a.width + j) + c]);
                const auto reference = static_cast<double>(b.rgb[3 * (i * a.width + j) + c]);
                if (!std::isfinite(value) || !std::isfinite(reference)) {
                    throw InputError(fmt::format("a value at row {}, column {} is not finite", i, j));
                }
                const double difference = value - reference;
                squares += difference * difference;
                sum += difference;
                reference_sum += reference;
                result.max_abs = std::max(result.max_abs, std::abs(difference));
                reference_max = std::max(reference_max, std::abs(reference));
            }
        }
    }
    if (result.pixels == 0) throw InputError("the pictures have no pixel in common that both show");
    const double values = 3 * static_cast<double>(result.pixels);
    result.rmse = std::sqrt(squares / values);
    result.bias = sum / values;
    result.reference_mean = reference_sum / values;
    result.rel_rmse = over(result.rmse, result.reference_mean);
    result.rel_bias = over(result.bias, result.reference_mean);
    result.psnr =
        result.rmse == 0 ? std::numeric_limits<double>::infinity() : 20 * std::log10(reference_max / result.rmse);
    return result;
}

}  // namespace clerestory
