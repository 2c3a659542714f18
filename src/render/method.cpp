#include "render/method.hpp"

#include <fmt/format.h>

#include "base/named_values.hpp"

namespace clerestory {
namespace {

const NamedValues<Estimator>& estimators() {
    static const NamedValues<Estimator> all("estimator", {{Estimator::shared, "shared"},
                                                          {Estimator::per_pixel, "per-pixel"},
                                                          {Estimator::exact, "exact"},
                                                          {Estimator::harmonic, "harmonic"}});
    return all;
}

}  // namespace

std::vector<std::string> estimator_names() { return estimators().names(); }
std::string estimator_name(Estimator estimator) { return estimators().name_of(estimator); }
Estimator estimator_by_name(const std::string& name) { return estimators().by_name(name); }

bool draws_samples(Estimator estimator) { return estimator == Estimator::shared || estimator == Estimator::per_pixel; }

std::string method_name(const RenderOptions& method) {
    std::string name = estimator_name(method.estimator);
    if (method.estimator == Estimator::harmonic) {
        name += fmt::format(", L = {}, K = {}", method.harmonic.degree, method.harmonic.lights);
    } else if (draws_samples(method.estimator)) {
        name += fmt::format(" {}, N = {}", sequence_name(method.sampling.sequence), method.samples);
        if (method.sampling.control_degree > 0) name += fmt::format(", L = {}", method.sampling.control_degree);
    }
    return name;
}

std::string method_flags(const RenderOptions& method) {
    std::string flags = "--estimator " + estimator_name(method.estimator);
    if (method.estimator == Estimator::harmonic) {
        flags += fmt::format(" --degree {} --lights {}", method.harmonic.degree, method.harmonic.lights);
    } else if (draws_samples(method.estimator)) {
        flags += fmt::format(" --sequence {} -n {} --control-degree {}", sequence_name(method.sampling.sequence),
                             method.samples, method.sampling.control_degree);
    }
    return flags;
}

}  // namespace clerestory
