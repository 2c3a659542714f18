#include "measure/choose_estimator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/statistics.hpp"
#include "error.hpp"
#include "measure/error_meter.hpp"
#include "render/method.hpp"

namespace clerestory {
namespace {

constexpr std::size_t PROBE_SIZE = 63;  // 3100 pixels: the error of a smooth picture within a few percent
/// Share of the target that the small picture's error may take: its pixels are not all of the large one's.
constexpr double SHARE_IN_HAND = 0.9;
/// Larger pictures are timed at two smaller sizes, and the line through both carries on.
constexpr std::size_t LARGEST_TIMED = 511;
constexpr std::size_t SMALLER_TIMED = 255;
constexpr std::size_t LARGEST_SAMPLES = 65536;
constexpr std::size_t SAMPLES_BESIDE_HARMONICS = 4096;
/// Degree and number of lights, from cheap to dear.
constexpr std::array<std::pair<std::size_t, std::size_t>, 11> HARMONICS = {
    {{2, 0}, {4, 0}, {8, 0}, {12, 0}, {8, 64}, {12, 64}, {20, 64}, {20, 256}, {30, 256}, {40, 1024}, {40, 4096}}};
/// Of these so many that reach the target are timed: the next ones cost more.
constexpr std::size_t TIMED_HARMONICS = 2;
/// The plain estimator among them: a thousand of its samples may cost less than a control variate's projection.
constexpr std::array<unsigned, 4> CONTROL_DEGREES = {0, 2, 4, 8};
/// For maps of which harmonics up to 40 with thousands of lights miss the target.
constexpr unsigned HIGH_CONTROL_DEGREE = 20;

struct Candidate {
    RenderOptions method;
    double error = 0;
    double seconds = 0;
};

class Chooser {
  public:
    Chooser(Renderer& renderer, const Scene& scene, const RenderOptions& asked, double target)
        : meter_(renderer, scene), asked_(asked), target_(target) {}

    TargetChoice choose() {
        if (!(meter_.exact(probe(exact())).mean > 0)) {
            return chosen({exact(), 0, 0}, "no light reaches what is seen of the sphere");
        }
        collect_harmonics();
        collect_shared();
        time_candidates();
        std::sort(candidates_.begin(), candidates_.end(),
                  [](const Candidate& a, const Candidate& b) { return a.seconds < b.seconds; });
        const double best = candidates_.empty() ? std::numeric_limits<double>::infinity() : candidates_[0].seconds;
        if (best > meter_.exact(probe(exact())).times.total()) {
            const Candidate last{exact(), 0, exact_seconds()};
            if (last.seconds < best) candidates_.insert(candidates_.begin(), last);
        }
        return chosen(candidates_[0], reason());
    }

  private:
    [[nodiscard]] RenderOptions exact() const {
        RenderOptions m = asked_;
        m.estimator = Estimator::exact;
        return m;
    }
    [[nodiscard]] RenderOptions probe(RenderOptions m) const {
        m.size = std::min(m.size, PROBE_SIZE);
        return m;
    }
    double error_of(const RenderOptions& m) { return root_mean_square(meter_.run(probe(m)).errors); }
    [[nodiscard]] bool reaches(double error) const { return error <= SHARE_IN_HAND * target_; }

    void collect_harmonics() {
        std::size_t found = 0;
        for (const auto& [degree, lights] : HARMONICS) {
            RenderOptions m = asked_;
            m.estimator = Estimator::harmonic;
            m.harmonic.degree = degree;
            m.harmonic.lights = lights;
            const double error = error_of(m);
            if (!reaches(error)) continue;
            candidates_.push_back({m, error, 0});
            if (++found == TIMED_HARMONICS) return;
        }
    }

    /// The fewest samples that do, at each degree.
    void collect_shared() {
        std::vector<unsigned> degrees(CONTROL_DEGREES.begin(), CONTROL_DEGREES.end());
        if (candidates_.empty()) degrees.push_back(HIGH_CONTROL_DEGREE);
        // Where harmonics do, more samples than this cost more than they.
        const std::size_t largest = candidates_.empty() ? LARGEST_SAMPLES : SAMPLES_BESIDE_HARMONICS;
        for (const unsigned degree : degrees) {
            RenderOptions m = asked_;
            m.estimator = Estimator::shared;
            m.sampling.sequence = Sequence::sobol;
            m.sampling.control_degree = degree;
            for (m.samples = 4; m.samples <= largest; m.samples *= 2) {
                const double error = error_of(m);
                if (!reaches(error)) continue;
                candidates_.push_back({m, error, 0});
                break;
            }
        }
    }

    double seconds_at(RenderOptions m, std::size_t size) {
        constexpr int RUNS = 2;
        m.size = size;
        double least = std::numeric_limits<double>::infinity();
        for (int k = 0; k < RUNS; ++k) least = std::min(least, meter_.time(m).total());
        return least;
    }

    /// Times all that may be the fastest; the others keep what two small pictures foretell.
    void time_candidates() {
        constexpr double DOUBT = 3;  // that a forecast may be off by
        if (asked_.size <= 2 * PROBE_SIZE) {
            for (Candidate& c : candidates_) c.seconds = seconds_of(c.method);
            return;
        }
        double least = std::numeric_limits<double>::infinity();
        for (Candidate& c : candidates_) {
            c.seconds = extrapolated(c.method, PROBE_SIZE, 2 * PROBE_SIZE);
            least = std::min(least, c.seconds);
        }
        for (Candidate& c : candidates_) {
            if (c.seconds <= DOUBT * least) c.seconds = seconds_of(c.method);
        }
    }

    /// Seconds at the picture's size, from two smaller sizes.
    double extrapolated(const RenderOptions& m, std::size_t small_side, std::size_t large_side) {
        const auto square = [](std::size_t side) { return static_cast<double>(side) * static_cast<double>(side); };
        const double small = seconds_at(m, small_side);
        const double large = seconds_at(m, large_side);
        const double a_pixel = std::max(0.0, large - small) / (square(large_side) - square(small_side));
        return large + a_pixel * (square(m.size) - square(large_side));
    }

    double seconds_of(const RenderOptions& m) {
        return m.size <= LARGEST_TIMED ? seconds_at(m, m.size) : extrapolated(m, SMALLER_TIMED, LARGEST_TIMED);
    }

    /// It may take seconds, more than all others together.
    double exact_seconds() {
        return asked_.size <= 2 * PROBE_SIZE ? seconds_at(exact(), asked_.size)
                                             : extrapolated(exact(), PROBE_SIZE, 2 * PROBE_SIZE);
    }

    [[nodiscard]] std::string reason() const {
        constexpr double MS = 1000;
        const std::string time = fmt::format("{:.3g} ms", MS * candidates_[0].seconds);
        if (candidates_.size() == 1) return fmt::format("nothing else that was tried reaches it; {}", time);
        return fmt::format("of {} ways that reach it here the fastest, {}; next {}, {:.3g} ms", candidates_.size(),
                           time, method_name(candidates_[1].method), MS * candidates_[1].seconds);
    }

    [[nodiscard]] static TargetChoice chosen(const Candidate& candidate, const std::string& why) {
        return {candidate.method, candidate.error, method_flags(candidate.method), why};
    }

    ErrorMeter meter_;
    RenderOptions asked_;
    double target_;
    std::vector<Candidate> candidates_;
};

}  // namespace

TargetChoice choose_estimator(Renderer& renderer, const Scene& scene, const RenderOptions& asked, double target_error) {
    if (!(target_error > 0) || !std::isfinite(target_error)) {
        throw UsageError(fmt::format("a target error of {} cannot be reached: give a positive number", target_error));
    }
    if (scene.distribution().black()) {
        RenderOptions method = asked;
        method.estimator = Estimator::exact;
        return {method, 0, method_flags(method), "the map is black"};
    }
    return Chooser(renderer, scene, asked, target_error).choose();
}

}  // namespace clerestory
