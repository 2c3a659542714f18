#include "study/measure.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

#include "base/clock.hpp"
#include "base/statistics.hpp"
#include "render/method.hpp"

namespace clerestory {
namespace {

constexpr std::size_t FEWEST_SEEDS = 3;        // below this a spread says nothing
constexpr std::size_t TIMED_RUNS = 5;          // of methods without seeds
constexpr double TURNS_SHARE = 0.12;           // of the budget, for times in turns
constexpr double FIRST_RUN_SECONDS = 0.5;      // a guess for kernels that have never run: they may have to be compiled
constexpr double LEAST_SECONDS_A_RUN = 0.004;  // statistics of one picture at the usual size

/// Work of one picture in multiply-adds, roughly: what cheap points are told from dear ones by.
double relative_cost(const RenderOptions& m) {
    constexpr double DRAW_A_PIXEL = 12;  // a draw of one's own, in pairs of pixel and shared sample
    constexpr double EXACT = 2048;
    const double degree_share = 1 + m.sampling.control_degree / 8.0;
    switch (m.estimator) {
        case Estimator::shared:
            return static_cast<double>(m.samples) * degree_share;
        case Estimator::per_pixel:
            return DRAW_A_PIXEL * static_cast<double>(m.samples) * degree_share;
        case Estimator::harmonic:
            return static_cast<double>(m.harmonic.lights + m.harmonic.degree * m.harmonic.degree);
        case Estimator::exact:
            break;
    }
    return EXACT;
}

/// Methods of one family run the same kernels and take time in proportion to their work at most.
using Family = std::tuple<Estimator, Sequence, unsigned>;
Family family_of(const RenderOptions& m) {
    return {m.estimator, m.sampling.sequence, draws_samples(m.estimator) ? m.sampling.control_degree : 0};
}

/// Foretells seconds of a picture from what its family took before, or another of the same estimator.
class Forecast {
  public:
    /// Once the kernels run.
    [[nodiscard]] double picture(const RenderOptions& m) const {
        const auto family = families_.find(family_of(m));
        if (family != families_.end()) return scaled(family->second, m);
        const auto kin = estimators_.find(m.estimator);
        return kin == estimators_.end() ? LEAST_SECONDS_A_RUN : scaled(kin->second, m);
    }
    /// What the next picture takes.
    [[nodiscard]] double next(const RenderOptions& m) const {
        return picture(m) + (is_open(m) ? 0 : FIRST_RUN_SECONDS);
    }
    /// What points are ordered by: a new kernel is for all points of its family.
    [[nodiscard]] double order(const RenderOptions& m) const {
        constexpr double POINTS_A_FAMILY = 6;
        return picture(m) + (is_open(m) ? 0 : FIRST_RUN_SECONDS / POINTS_A_FAMILY);
    }
    [[nodiscard]] bool is_open(const RenderOptions& m) const { return families_.contains(family_of(m)); }
    void learn(const RenderOptions& m, double seconds) {
        families_[family_of(m)] = estimators_[m.estimator] = {relative_cost(m), seconds};
    }

    /// Seconds that `runs` pictures of each of these methods take.
    [[nodiscard]] double all(const std::vector<RenderOptions>& methods, std::size_t runs) const {
        double seconds = 0;
        std::set<Family> unopened;
        for (const auto& m : methods) {
            seconds += static_cast<double>(runs) * picture(m);
            if (!is_open(m) && unopened.insert(family_of(m)).second) seconds += FIRST_RUN_SECONDS;
        }
        return seconds;
    }

  private:
    struct Seen {
        double cost = 0, seconds = 0;
    };
    static double scaled(const Seen& seen, const RenderOptions& m) {
        return std::max(LEAST_SECONDS_A_RUN, seen.seconds * std::max(1.0, relative_cost(m) / seen.cost));
    }
    std::map<Family, Seen> families_;
    std::map<Estimator, Seen> estimators_;
};

void set_times(StudyPoint& point, const std::vector<MethodTimes>& runs) {
    const auto quartiles = [&](auto part) {
        std::vector<double> values;
        for (const auto& run : runs) values.push_back(std::invoke(part, run));
        return quartiles_of(std::move(values));
    };
    point.seconds = quartiles(&MethodTimes::total);
    point.stages.project = quartiles(&MethodTimes::project).median;
    point.stages.draw = quartiles(&MethodTimes::draw).median;
    point.stages.shade = quartiles(&MethodTimes::shade).median;
}

/// Sums over the seeds of one point.
class PointSums {
  public:
    void add(const MethodRun& run) {
        if (sum_.empty()) sum_.assign(run.errors.size(), 0.0F);
        std::vector<double> sizes(run.errors.size());
        for (std::size_t i = 0; i < run.errors.size(); ++i) {
            sum_[i] += run.errors[i];
            sizes[i] = std::abs(static_cast<double>(run.errors[i]));
        }
        worst_ = std::max(worst_, *std::max_element(sizes.begin(), sizes.end()));
        constexpr double SHARE = 0.99;
        percentiles_.push_back(quantile(std::move(sizes), SHARE));
        rel_rmse_.push_back(root_mean_square(run.errors));
        times_.push_back(run.times);
    }

    [[nodiscard]] StudyPoint point(const RenderOptions& method) const {
        StudyPoint p;
        p.method = method;
        p.seeds = rel_rmse_.size();
        const auto n = static_cast<double>(p.seeds);
        const double squares = std::inner_product(rel_rmse_.begin(), rel_rmse_.end(), rel_rmse_.begin(), 0.0);
        p.rel_rmse = std::sqrt(squares / n);
        p.rel_rmse_deviation = spread_of(rel_rmse_).deviation;
        p.bias = root_mean_square(sum_) / n;
        // Mean over pixels of the variance of one seed, over n: the variance of the mean.
        if (p.seeds > 1) p.bias_noise = std::sqrt(std::max(0.0, (squares / n - p.bias * p.bias) / (n - 1)));
        p.worst = worst_;
        p.percentile99 = spread_of(percentiles_).mean;
        set_times(p, times_);
        if (!draws_samples(method.estimator)) p.seeds = 1;
        return p;
    }

  private:
    std::vector<float> sum_;
    std::vector<double> rel_rmse_, percentiles_;
    std::vector<MethodTimes> times_;
    double worst_ = 0;
};

using GridKey = std::tuple<Estimator, unsigned, Sequence, std::size_t, std::size_t, std::size_t>;
/// Sorts methods by kind, then from few samples, degrees and lights to many.
GridKey grid_key(const RenderOptions& m) {
    const bool sampled = draws_samples(m.estimator);
    return {m.estimator,         sampled ? m.sampling.control_degree : 0,
            m.sampling.sequence, sampled ? m.samples : 0,
            m.harmonic.degree,   m.harmonic.lights};
}

}  // namespace

Quartiles quartiles_of(std::vector<double> values) {
    if (values.empty()) return {};
    std::sort(values.begin(), values.end());
    const auto at = [&](double share) {
        const double place = share * static_cast<double>(values.size() - 1);
        const auto low = static_cast<std::size_t>(place);
        const auto high = std::min(low + 1, values.size() - 1);
        const double part = place - static_cast<double>(low);
        return (1 - part) * values[low] + part * values[high];
    };
    return {at(0.5), at(0.25), at(0.75)};
}

std::vector<RenderOptions> study_grid(const RenderOptions& base) {
    std::vector<RenderOptions> grid;
    const auto sampled = [&](Estimator estimator, std::size_t largest, std::size_t factor) {
        for (const unsigned degree : {0U, 8U, 2U, 20U}) {
            for (const Sequence sequence : {Sequence::random, Sequence::stratified, Sequence::sobol}) {
                for (std::size_t n = 4; n <= largest; n *= factor) {
                    RenderOptions m = base;
                    m.estimator = estimator;
                    m.samples = n;
                    m.sampling.sequence = sequence;
                    m.sampling.control_degree = degree;
                    grid.push_back(m);
                }
            }
        }
    };
    for (const std::size_t degree : {2U, 4U, 8U, 12U, 20U, 30U, 40U}) {
        for (const std::size_t lights : {0U, 64U, 256U, 1024U, 4096U}) {
            RenderOptions m = base;
            m.estimator = Estimator::harmonic;
            m.sampling.control_degree = 0;
            m.harmonic.degree = degree;
            m.harmonic.lights = lights;
            grid.push_back(m);
        }
    }
    sampled(Estimator::shared, 65536, 4);
    sampled(Estimator::per_pixel, 64, 2);
    return grid;
}

namespace {

/// The picture that all are held against, timed as it is made; again where that is quick.
StudyPoint measure_exact(ErrorMeter& meter, const RenderOptions& base) {
    constexpr double QUICK_SECONDS = 0.25;
    RenderOptions method = base;
    method.estimator = Estimator::exact;
    PointSums sums;
    sums.add({meter.exact(method).times, std::vector<float>(1, 0.0F)});
    if (meter.exact(method).times.total() < QUICK_SECONDS) {
        for (std::size_t k = 1; k < TIMED_RUNS; ++k) sums.add({meter.time(method), std::vector<float>(1, 0.0F)});
    }
    return sums.point(method);
}

/// Times quick points anew, one after the other and again, until that takes too long: a machine whose speed drifts
/// then treats all of them alike. The first times stay where there is no time for enough turns.
///   in_time  whether there is time for another picture
void time_in_turns(ErrorMeter& meter, std::vector<StudyPoint>& points, const std::function<bool()>& in_time) {
    constexpr double QUICK_SECONDS = 0.03;
    constexpr std::size_t TURNS = 15;
    std::vector<std::size_t> quick;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (points[i].seconds.median <= QUICK_SECONDS) quick.push_back(i);
    }
    std::vector<std::vector<MethodTimes>> times(quick.size());
    for (std::size_t turn = 0; turn < TURNS; ++turn) {
        for (std::size_t k = 0; k < quick.size() && in_time(); ++k) {
            times[k].push_back(meter.time(points[quick[k]].method));
        }
    }
    for (std::size_t k = 0; k < quick.size(); ++k) {
        if (times[k].size() >= TIMED_RUNS) set_times(points[quick[k]], times[k]);
    }
}

}  // namespace

StudyMeasurements measure_study(ErrorMeter& meter, const StudyOptions& options, const ProgressFunction& progress) {
    const Stopwatch watch;
    const auto left = [&] { return (1 - TURNS_SHARE) * options.budget_seconds - watch.seconds(); };
    std::vector<RenderOptions> waiting = study_grid(options.base);
    StudyMeasurements result;
    result.points.push_back(measure_exact(meter, options.base));
    Forecast forecast;
    while (!waiting.empty()) {
        const auto cheapest = std::min_element(waiting.begin(), waiting.end(), [&](const auto& a, const auto& b) {
            return forecast.order(a) < forecast.order(b);
        });
        if (forecast.next(*cheapest) > left()) break;
        // Every point gets its fewest seeds before any gets more.
        const double spare = std::max(0.0, left() - forecast.all(waiting, FEWEST_SEEDS));
        const RenderOptions method = *cheapest;
        const double share = spare / static_cast<double>(waiting.size());
        waiting.erase(cheapest);
        const std::size_t wanted =
            draws_samples(method.estimator) ? options.seeds : std::min(TIMED_RUNS, options.seeds);
        const double affordable = static_cast<double>(FEWEST_SEEDS) + share / forecast.picture(method);
        const auto runs = affordable < static_cast<double>(wanted) ? static_cast<std::size_t>(affordable) : wanted;
        PointSums sums;
        double seconds = 0;
        std::size_t taken = 0;
        while (taken < runs && (taken == 0 || seconds < left())) {
            RenderOptions seeded = method;
            seeded.sampling.seed = options.base.sampling.seed + taken;
            const Stopwatch one;
            sums.add(meter.run(seeded));
            seconds = one.seconds();
            ++taken;
            if (progress) progress(watch.seconds(), options.budget_seconds);
        }
        forecast.learn(method, seconds);
        result.points.push_back(sums.point(method));
        result.short_of_seeds += draws_samples(method.estimator) && taken < options.seeds ? 1 : 0;
    }
    result.left_out = std::move(waiting);
    time_in_turns(meter, result.points, [&] {
        if (progress) progress(watch.seconds(), options.budget_seconds);
        return watch.seconds() < options.budget_seconds;
    });
    std::sort(result.points.begin(), result.points.end(),
              [](const StudyPoint& a, const StudyPoint& b) { return grid_key(a.method) < grid_key(b.method); });
    result.seconds = watch.seconds();
    return result;
}

std::vector<StudyTable> measure_tables(const Device& device, const Scene& scene, Luminance luminance) {
    // Checking a table costs far more than building it: large maps are built once.
    constexpr std::size_t MANY_TEXELS = std::size_t{4} << 20;
    const auto texels = scene.device_map().width * scene.device_map().height;
    const std::size_t runs = texels > MANY_TEXELS ? 1 : FEWEST_SEEDS;
    std::vector<StudyTable> tables;
    for (const TableArithmetic arithmetic : TABLE_ARITHMETICS) {
        if (arithmetic == TableArithmetic::f64 && !device.info().has_fp64) continue;
        StudyTable table;
        std::vector<double> seconds;
        for (std::size_t k = 0; k < runs; ++k) {
            table.report = measure_table_arithmetic(device, scene.device_map(), luminance, arithmetic);
            seconds.push_back(table.report.seconds);
        }
        table.seconds = quartiles_of(seconds);
        tables.push_back(table);
    }
    return tables;
}

}  // namespace clerestory
