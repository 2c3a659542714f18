#include "measure/error_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/statistics.hpp"
#include "shading/pixels.hpp"

namespace clerestory {
namespace {

// Squares larger than this hide what the sphere itself looks like at the picture's usual size.
constexpr std::size_t LARGEST_BLOCK = 32;
// A square of an eighth of the picture has room inside the disc wherever squares start.
constexpr std::size_t BLOCKS_ACROSS = 8;

std::vector<std::size_t> sides_for(std::size_t size) {
    std::vector<std::size_t> sides = {1};
    while (2 * sides.back() <= std::min(LARGEST_BLOCK, size / BLOCKS_ACROSS)) sides.push_back(2 * sides.back());
    return sides;
}

/// Means over squares of 2 x 2.
///   values [width * width], width even
std::vector<double> halved(const std::vector<double>& values, std::size_t width) {
    const std::size_t half = width / 2;
    std::vector<double> means(half * half);
    for (std::size_t i = 0; i < half; ++i) {
        for (std::size_t j = 0; j < half; ++j) {
            const double* at = values.data() + 2 * i * width + 2 * j;
            means[i * half + j] = (at[0] + at[1] + at[width] + at[width + 1]) / 4;
        }
    }
    return means;
}

/// Sums over seeds, from which mean and spread come.
struct Sums {
    explicit Sums(std::size_t count) : first(count), second(count) {}
    void add(const ErrorPlanes& errors) {
        for (std::size_t i = 0; i < errors.size(); ++i) {
            const auto e = static_cast<double>(errors[i]);
            first[i] += e;
            second[i] += e * e;
        }
    }
    std::vector<double> first, second;
};

/// Places of the pixels that have another to their right, and of that one. The list of pixels is in no order of rows.
std::vector<std::pair<std::size_t, std::size_t>> side_by_side(const std::vector<cl_uint>& pixel, std::size_t size) {
    constexpr std::size_t NONE = std::numeric_limits<std::size_t>::max();
    std::vector<std::size_t> place(size * size + 1, NONE);  // one more, so that the last pixel has no neighbour
    for (std::size_t i = 0; i < pixel.size(); ++i) place[pixel[i]] = i;
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t i = 0; i < pixel.size(); ++i) {
        const std::size_t right = std::size_t{pixel[i]} + 1;
        if (right % size != 0 && place[right] != NONE) pairs.emplace_back(i, place[right]);
    }
    return pairs;
}

}  // namespace

ErrorStatistics::ErrorStatistics(const SphereView& view)
    : size_(view.size), pixel_(view.pixel.download()), sides_(sides_for(view.size)) {
    pixel_.resize(view.count);
    neighbours_ = side_by_side(pixel_, size_);
    find_blocked();
}

/// Pixels of squares of the largest side that lie in the disc wholly: the same for every side.
void ErrorStatistics::find_blocked() {
    const std::size_t side = sides_.back();
    const std::size_t across = size_ / side;
    std::vector<std::size_t> filled(across * across, 0);
    const auto block_of = [&](std::size_t i) -> std::optional<std::size_t> {
        const std::size_t row = pixel_[i] / size_ / side;
        const std::size_t column = pixel_[i] % size_ / side;
        if (row >= across || column >= across) return {};
        return row * across + column;
    };
    for (std::size_t i = 0; i < pixel_.size(); ++i) {
        if (const auto block = block_of(i)) ++filled[*block];
    }
    for (std::size_t i = 0; i < pixel_.size(); ++i) {
        const auto block = block_of(i);
        if (block && filled[*block] == side * side) blocked_.push_back(i);
    }
}

/// One plane's errors at the pixels of whole squares, 0 elsewhere.
///   returns [across * across * side^2], rows of across * side
std::vector<double> ErrorStatistics::blocked_plane(const ErrorPlanes& errors, std::size_t plane) const {
    const std::size_t width = size_ / sides_.back() * sides_.back();
    std::vector<double> values(width * width, 0);
    for (const std::size_t i : blocked_) {
        values[pixel_[i] / size_ * width + pixel_[i] % size_] = static_cast<double>(errors[plane * pixels() + i]);
    }
    return values;
}

/// Mean over channels and pixels of the product of errors side by side, over that of squares.
double ErrorStatistics::neighbour_correlation(const ErrorPlanes& errors) const {
    double products = 0;
    double squares = 0;
    for (const auto& [i, j] : neighbours_) {
        for (std::size_t c = 0; c < 3; ++c) {
            const auto left = static_cast<double>(errors[c * pixels() + i]);
            const auto right = static_cast<double>(errors[c * pixels() + j]);
            products += left * right;
            squares += (left * left + right * right) / 2;
        }
    }
    return squares > 0 ? products / squares : 0;
}

std::vector<double> ErrorStatistics::block_rms(const ErrorPlanes& errors) const {
    std::vector<double> squares(sides_.size(), 0.0);
    for (std::size_t c = 0; c < 3; ++c) {
        std::vector<double> means = blocked_plane(errors, c);
        std::size_t width = size_ / sides_.back() * sides_.back();
        for (std::size_t level = 0; level < sides_.size(); ++level) {
            if (level > 0) {
                means = halved(means, width);
                width /= 2;
            }
            const auto area = static_cast<double>(sides_[level] * sides_[level]);
            for (const double mean : means) squares[level] += area * mean * mean;
        }
    }
    for (double& square : squares) square = std::sqrt(square / (3 * static_cast<double>(blocked_.size())));
    return squares;
}

ErrorParts ErrorStatistics::parts_of(const ErrorPlanes& errors) const {
    ErrorParts parts;
    parts.rel_rmse = root_mean_square(errors);
    for (const float error : errors) parts.rel_bias += static_cast<double>(error);
    parts.rel_bias /= static_cast<double>(errors.size());
    parts.neighbour_correlation = neighbour_correlation(errors);
    parts.block_rms = block_rms(errors);
    return parts;
}

std::vector<float> ErrorStatistics::as_picture(const ErrorPlanes& planes) const {
    std::vector<float> picture(size_ * size_, std::numeric_limits<float>::quiet_NaN());
    for (std::size_t i = 0; i < pixels(); ++i) {
        picture[pixel_[i]] = (planes[i] + planes[pixels() + i] + planes[2 * pixels() + i]) / 3;
    }
    return picture;
}

SeedErrors errors_over_seeds(ErrorMeter& meter, const ErrorStatistics& statistics, const RenderOptions& method,
                             std::size_t count, const ProgressFunction& progress) {
    SeedErrors over;
    over.method = method;
    over.block_rms.assign(statistics.block_sides().size(), 0.0);
    Sums sums(3 * statistics.pixels());
    const auto n = static_cast<double>(count);
    for (std::size_t k = 0; k < count; ++k) {
        RenderOptions seeded = method;
        seeded.sampling.seed += k;
        const auto [times, errors] = meter.run(seeded);
        const ErrorParts parts = statistics.parts_of(errors);
        over.rel_rmse.push_back(parts.rel_rmse);
        over.rel_bias.push_back(parts.rel_bias);
        over.seconds += times.total() / n;
        for (std::size_t b = 0; b < parts.block_rms.size(); ++b) {
            over.block_rms[b] += parts.block_rms[b] * parts.block_rms[b] / n;
        }
        sums.add(errors);
        if (progress) progress(static_cast<double>(k + 1), n);
    }
    for (double& block : over.block_rms) block = std::sqrt(block);
    over.mean.resize(sums.first.size());
    over.spread.resize(sums.first.size());
    for (std::size_t i = 0; i < sums.first.size(); ++i) {
        const double mean = sums.first[i] / n;
        over.mean[i] = static_cast<float>(mean);
        over.spread[i] = static_cast<float>(std::sqrt(std::max(sums.second[i] - n * mean * mean, 0.0) / (n - 1)));
    }
    over.mean_rms = root_mean_square(over.mean);
    over.spread_rms = root_mean_square(over.spread);
    return over;
}

}  // namespace clerestory
