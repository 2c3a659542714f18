#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "base/statistics.hpp"
#include "draw/panels.hpp"
#include "measure/error_meter.hpp"
#include "measure/error_statistics.hpp"
#include "render/method.hpp"
#include "study/report.hpp"

namespace clerestory {
namespace {

using plot::Colour;
using plot::Curve;
using plot::Plot;
using plot::Style;

constexpr double MS = 1000;
constexpr double PERCENT = 100;

/// Adds a point unless a logarithmic axis has no place for it.
void add_point(Curve& curve, double x, double y) {
    if (!(x > 0) || !(y > 0)) return;
    curve.x.push_back(x);
    curve.y.push_back(y);
}

void add_curve(Plot& plot, Curve curve) {
    if (!curve.x.empty()) plot.curves.push_back(std::move(curve));
}

plot::Axis logarithmic(const std::string& title, const std::string& unit = "") {
    return {.title = title, .unit = unit, .logarithmic = true};
}

plot::Axis error_axis() { return logarithmic("relative RMSE", "%"); }

constexpr const char* ERROR_TIME = "error_time";
constexpr const char* ERROR_SAMPLES_SHARED = "error_samples_shared";
constexpr const char* ERROR_SAMPLES_PER_PIXEL = "error_samples_per_pixel";
constexpr const char* HARMONIC = "harmonic";
constexpr const char* TABLE_ERROR_TIME = "table_error_time";

/// Error against samples of one estimator: three sequences, plain and with a control variate.
Plot samples_plot(const StudyMeasurements& measured, Estimator estimator, const std::string& name) {
    constexpr unsigned SHOWN_DEGREE = 8;
    constexpr std::array COLOURS = {Colour::vermillion, Colour::orange, Colour::blue};
    constexpr std::array CONTROLLED = {Colour::purple, Colour::green, Colour::sky};
    constexpr std::array SEQUENCES = {Sequence::random, Sequence::stratified, Sequence::sobol};
    Plot plot;
    plot.name = name;
    plot.title =
        estimator == Estimator::shared ? "One sample set for every pixel" : "A fresh sample set for each pixel";
    plot.x = logarithmic(estimator == Estimator::shared ? "samples" : "samples a pixel");
    plot.y = error_axis();
    for (const unsigned degree : {0U, SHOWN_DEGREE}) {
        for (std::size_t s = 0; s < SEQUENCES.size(); ++s) {
            Curve curve;
            curve.label = sequence_name(SEQUENCES[s]);
            if (degree > 0) curve.label += fmt::format(", control L = {}", degree);
            curve.style = Style::line_with_points;
            curve.colour = degree > 0 ? CONTROLLED[s] : COLOURS[s];
            for (const StudyPoint& p : measured.points) {
                if (p.method.estimator != estimator || p.method.sampling.sequence != SEQUENCES[s] ||
                    p.method.sampling.control_degree != degree) {
                    continue;
                }
                add_point(curve, static_cast<double>(p.method.samples), PERCENT * p.rel_rmse);
            }
            add_curve(plot, std::move(curve));
        }
    }
    return plot;
}

/// Marks the time of the exact picture, for which the axis has room even where all others are faster.
void mark_exact(Plot& plot, double seconds) {
    constexpr double ROOM_FOR_LABEL = 1.6;
    const double at = MS * seconds;
    plot.marks.push_back(
        {at, fmt::format("exact: {}", milliseconds(seconds)), plot::Direction::vertical, plot::Side::after});
    const bool slowest = std::all_of(plot.curves.begin(), plot.curves.end(), [&](const Curve& curve) {
        return std::all_of(curve.x.begin(), curve.x.end(), [&](double x) { return x < at; });
    });
    if (slowest) plot.x.max = ROOM_FOR_LABEL * at;
}

/// Error against time of all points, in families, with the front as a line.
Plot time_plot(const StudyMeasurements& measured) {
    struct Family {
        const char* label;
        Estimator estimator;
        bool controlled;
        Colour colour;
    };
    constexpr std::array FAMILIES = {Family{"shared, plain", Estimator::shared, false, Colour::vermillion},
                                     Family{"shared, control variate", Estimator::shared, true, Colour::blue},
                                     Family{"per-pixel, plain", Estimator::per_pixel, false, Colour::orange},
                                     Family{"per-pixel, control variate", Estimator::per_pixel, true, Colour::green},
                                     Family{"harmonic", Estimator::harmonic, false, Colour::purple}};
    Plot plot;
    plot.name = ERROR_TIME;
    plot.title = "What each millisecond buys";
    plot.x = logarithmic("time of one picture", "ms");
    plot.y = error_axis();
    plot.height = 540;
    for (const Family& family : FAMILIES) {
        Curve curve;
        curve.label = family.label;
        curve.style = Style::points;
        curve.colour = family.colour;
        for (const StudyPoint& p : measured.points) {
            if (p.method.estimator != family.estimator || (p.method.sampling.control_degree > 0) != family.controlled) {
                continue;
            }
            add_point(curve, MS * p.seconds.median, PERCENT * p.rel_rmse);
        }
        add_curve(plot, std::move(curve));
    }
    std::vector<const StudyPoint*> front;
    for (const StudyPoint& p : measured.points) {
        if (p.on_front) front.push_back(&p);
        if (p.method.estimator == Estimator::exact) mark_exact(plot, p.seconds.median);
    }
    std::sort(front.begin(), front.end(),
              [](const auto* a, const auto* b) { return a->seconds.median < b->seconds.median; });
    Curve line;
    line.label = "nothing is better";
    line.colour = Colour::sky;
    for (const StudyPoint* p : front) add_point(line, MS * p->seconds.median, PERCENT * p->rel_rmse);
    add_curve(plot, std::move(line));
    return plot;
}

/// Error of `harmonic` against its degree, for each number of lights.
Plot harmonic_plot(const StudyMeasurements& measured) {
    Plot plot;
    plot.name = HARMONIC;
    plot.title = "Spherical harmonics and the K brightest texels as lights";
    plot.x.title = "degree L";
    plot.x.min = 0;
    plot.y = error_axis();
    std::vector<std::size_t> lights;
    for (const StudyPoint& p : measured.points) {
        if (p.method.estimator != Estimator::harmonic) continue;
        if (std::find(lights.begin(), lights.end(), p.method.harmonic.lights) == lights.end()) {
            lights.push_back(p.method.harmonic.lights);
        }
    }
    std::sort(lights.begin(), lights.end());
    for (const std::size_t k : lights) {
        Curve curve;
        curve.label = fmt::format("K = {}", k);
        curve.style = Style::line_with_points;
        for (const StudyPoint& p : measured.points) {
            if (p.method.estimator != Estimator::harmonic || p.method.harmonic.lights != k) continue;
            add_point(curve, static_cast<double>(p.method.harmonic.degree), PERCENT * p.rel_rmse);
        }
        add_curve(plot, std::move(curve));
    }
    return plot;
}

Plot table_plot(const StudyMeasurements& measured) {
    Plot plot;
    plot.name = TABLE_ERROR_TIME;
    plot.title = "Tables of the same map in four arithmetics";
    plot.x.title = "time to build";
    plot.x.unit = "ms";
    plot.x.min = 0;
    plot.y = logarithmic("probability in the wrong texel");
    double longest = 0;
    for (const StudyTable& table : measured.tables) {
        Curve curve;
        curve.label = name_of(table.report.arithmetic);
        curve.style = Style::points;
        add_point(curve, MS * table.seconds.median, table.report.total_variation);
        longest = std::max(longest, MS * table.seconds.median);
        add_curve(plot, std::move(curve));
    }
    constexpr double ROOM = 1.15;  // to the right of the last point
    plot.x.max = ROOM * longest;
    return plot;
}

}  // namespace

std::vector<Plot> study_plots(const StudyMeasurements& measured) {
    std::vector<Plot> plots = {time_plot(measured), samples_plot(measured, Estimator::shared, ERROR_SAMPLES_SHARED),
                               samples_plot(measured, Estimator::per_pixel, ERROR_SAMPLES_PER_PIXEL),
                               harmonic_plot(measured), table_plot(measured)};
    std::erase_if(plots, [](const Plot& plot) { return plot.curves.empty(); });
    return plots;
}

std::vector<std::string> study_files() {
    std::vector<std::string> files = {"study.csv", "study.json", "index.html"};
    for (const char* plot :
         {ERROR_TIME, ERROR_SAMPLES_SHARED, ERROR_SAMPLES_PER_PIXEL, HARMONIC, TABLE_ERROR_TIME, ERROR_MAPS}) {
        files.push_back(std::string(plot) + ".svg");
    }
    return files;
}

std::string error_maps(ErrorMeter& meter, const RenderOptions& base) {
    constexpr std::size_t MAP_SIZE = 191;  // six of them in a page of a few hundred kilobytes
    constexpr double LIMIT = 3;            // of each picture's own RMSE
    const auto sampled = [&](Estimator estimator, Sequence sequence, unsigned degree, std::size_t samples) {
        RenderOptions m = base;
        m.estimator = estimator;
        m.samples = samples;
        m.sampling.sequence = sequence;
        m.sampling.control_degree = degree;
        return m;
    };
    RenderOptions harmonic = base;
    harmonic.estimator = Estimator::harmonic;
    const std::vector<RenderOptions> methods = {
        sampled(Estimator::shared, Sequence::random, 0, 1024), sampled(Estimator::shared, Sequence::sobol, 0, 1024),
        sampled(Estimator::shared, Sequence::sobol, 8, 1024),  sampled(Estimator::per_pixel, Sequence::random, 0, 32),
        sampled(Estimator::per_pixel, Sequence::sobol, 8, 32), harmonic};
    PanelSheet sheet;
    sheet.name = ERROR_MAPS;
    sheet.title = "Where the error lies";
    sheet.limit = LIMIT;
    sheet.diverging_label = "too dark, too bright: error in parts of the picture's own relative RMSE";
    for (RenderOptions method : methods) {
        method.size = std::min(base.size, MAP_SIZE);
        const MethodRun run = meter.run(method);
        const double rmse = root_mean_square(run.errors);
        Panel panel;
        panel.title = method_name(method);
        panel.note = "relative RMSE " + percents(rmse);
        panel.size = method.size;
        panel.values = ErrorStatistics(meter.view(method.size)).as_picture(run.errors);
        if (rmse > 0) {
            for (float& value : panel.values) value = static_cast<float>(static_cast<double>(value) / rmse);
        }
        sheet.panels.push_back(std::move(panel));
    }
    return panels_svg(sheet);
}

}  // namespace clerestory
