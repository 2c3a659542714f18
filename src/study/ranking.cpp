#include "study/ranking.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>

#include "render/method.hpp"

namespace clerestory {
namespace {

constexpr std::array MILLISECOND_LIMITS = {1.0, 5.0, 20.0, 100.0};
constexpr std::array PERCENT_LIMITS = {1.0, 0.1, 0.01};

std::string three_digits(double value) {
    if (value == 0) return "0";
    const int whole = static_cast<int>(std::floor(std::log10(std::abs(value)))) + 1;
    return fmt::format("{:.{}f}", value, std::clamp(3 - whole, 0, 6));
}

const StudyPoint* best_of(const std::vector<StudyPoint>& points, auto&& fits, auto&& worse) {
    const StudyPoint* best = nullptr;
    for (const StudyPoint& point : points) {
        if (fits(point) && (best == nullptr || worse(*best, point))) best = &point;
    }
    return best;
}

std::string answer(const std::string& question, const StudyPoint* point) {
    if (point == nullptr) return question + ": nothing that was measured";
    const std::string error = point->rel_rmse == 0 ? "no error but rounding" : percents(point->rel_rmse) + " error";
    return fmt::format("{}: {} ({}, {})", question, method_name(point->method), milliseconds(point->seconds.median),
                       error);
}

}  // namespace

std::string milliseconds(double seconds) {
    constexpr double MS = 1000;
    return seconds < 1 ? three_digits(MS * seconds) + " ms" : three_digits(seconds) + " s";
}

std::string percents(double share) {
    constexpr double PERCENT = 100;
    return three_digits(PERCENT * share) + " %";
}

std::vector<StudySlope> fit_slopes(const std::vector<StudyPoint>& points) {
    struct Series {
        std::vector<double> samples, errors;
    };
    std::map<std::tuple<Estimator, unsigned, Sequence>, Series> families;
    for (const StudyPoint& point : points) {
        const RenderOptions& m = point.method;
        if (m.estimator != Estimator::shared && m.estimator != Estimator::per_pixel) continue;
        Series& series = families[{m.estimator, m.sampling.control_degree, m.sampling.sequence}];
        series.samples.push_back(static_cast<double>(m.samples));
        series.errors.push_back(point.rel_rmse);
    }
    std::vector<StudySlope> slopes;
    for (const auto& [family, series] : families) {
        const auto& [estimator, degree, sequence] = family;
        const PowerLaw law = fit_power_law(series.samples, series.errors);
        constexpr std::size_t FEWEST_POINTS = 3;
        if (law.points >= FEWEST_POINTS) slopes.push_back({estimator, sequence, degree, law});
    }
    return slopes;
}

void mark_front(std::vector<StudyPoint>& points) {
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return std::pair(points[a].seconds.median, points[a].rel_rmse) <
               std::pair(points[b].seconds.median, points[b].rel_rmse);
    });
    double least = std::numeric_limits<double>::infinity();
    for (const std::size_t i : order) {
        points[i].on_front = points[i].rel_rmse < least;
        least = std::min(least, points[i].rel_rmse);
    }
}

std::vector<Verdict> verdicts(const std::vector<StudyPoint>& points) {
    std::vector<Verdict> all;
    for (const double limit : MILLISECOND_LIMITS) {
        const StudyPoint* best = best_of(
            points, [&](const StudyPoint& p) { return p.seconds.median <= limit / 1000; },
            [](const StudyPoint& a, const StudyPoint& b) { return b.rel_rmse < a.rel_rmse; });
        const std::string question = fmt::format("under {} ms", limit);
        all.push_back({question, best, answer(question, best)});
    }
    for (const double limit : PERCENT_LIMITS) {
        const auto reaches = [&](const StudyPoint& p) { return p.rel_rmse <= limit / 100; };
        const StudyPoint* fastest = best_of(points, reaches, [](const StudyPoint& a, const StudyPoint& b) {
            return b.seconds.median < a.seconds.median;
        });
        const StudyPoint* best = best_of(
            points,
            [&](const StudyPoint& p) { return reaches(p) && p.seconds.median <= SAME_TIME * fastest->seconds.median; },
            [](const StudyPoint& a, const StudyPoint& b) { return b.rel_rmse < a.rel_rmse; });
        const std::string question = fmt::format("for {} %", limit);
        all.push_back({question, best, answer(question, best)});
    }
    return all;
}

}  // namespace clerestory
