#pragma once

#include <string>
#include <vector>

#include "base/statistics.hpp"
#include "study/measure.hpp"

namespace clerestory {

/// How the error of one way to sample falls with the number of samples: error = factor N^slope.
struct StudySlope {
    Estimator estimator = Estimator::shared;
    Sequence sequence = Sequence::random;
    unsigned control_degree = 0;
    PowerLaw law;
};

/// Slopes of every way to sample that was measured at three numbers of samples or more.
std::vector<StudySlope> fit_slopes(const std::vector<StudyPoint>& points);

/// Marks the points that no other point beats in both time and error.
void mark_front(std::vector<StudyPoint>& points);

/// The answer to one question about a map on a machine.
struct Verdict {
    std::string question;               ///< "under 5 ms", "for 0.1 %"
    const StudyPoint* point = nullptr;  ///< none where no point answers it
    std::string sentence;
};

/// Times of a shared machine that are no further apart than this factor are the same.
inline constexpr double SAME_TIME = 1.15;

/// The best point under 1, 5, 20 and 100 ms, and the fastest for 1 %, 0.1 % and 0.01 %; of several that take the same
/// time, the one with the least error.
///   points  must outlive the verdicts
std::vector<Verdict> verdicts(const std::vector<StudyPoint>& points);

/// Milliseconds and percents as they read best.
std::string milliseconds(double seconds);
std::string percents(double share);

}  // namespace clerestory
