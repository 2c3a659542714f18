#include "tables/table_arithmetic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/exact_sum.hpp"
#include "base/named_values.hpp"
#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "error.hpp"
#include "map/latlong.hpp"
#include "map/luminance.hpp"

namespace clerestory {
namespace {

const double ONE = std::ldexp(1.0, TABLE_BITS);  ///< where every table ends

/// The kernels of table_arithmetic.cl for one type of sums, and what they work on.
template <class Real>
class RealTables {
  public:
    RealTables(const Device& device, const DeviceMap& map, Luminance luminance, bool compensated)
        : device_(device),
          map_(map),
          weights_(luminance_weights_f32(luminance)),
          program_(device, "table_arithmetic.cl",
                   fmt::format("-DREAL={} -DCOMPENSATED={:d}", sizeof(Real) == 8 ? "double" : "float", compensated)),
          sine_(device, "the rows' sines", std::span<const float>(row_geometry(map.width, map.height).sine)),
          totals_(device, "the rows' sums", map.height),
          marginal_(device, "the marginal table", map.height),
          sum_(device, "the sum", 1) {}

    void sum() {
        sum_rows_(rows(), map_.radiance, sine_, narrow(map_.width), narrow(map_.height), weights_[0], weights_[1],
                  weights_[2], totals_);
        scan_sums_(device_.single(), totals_, narrow(map_.height), marginal_, sum_);
    }

    void scan(Buffer<Real>& conditional) {
        scan_rows_(rows(), map_.radiance, sine_, totals_, narrow(map_.width), narrow(map_.height), weights_[0],
                   weights_[1], weights_[2], conditional);
        device_.finish();
    }

    /// After sum(): fills `lit` and `undrawable`.
    void count(ArithmeticReport& report) {
        Uints lit(device_, "the rows' lit texels", map_.height);
        Uints undrawable(device_, "the rows' undrawable texels", map_.height);
        count_undrawable_(rows(), map_.radiance, sine_, totals_, narrow(map_.width), narrow(map_.height), weights_[0],
                          weights_[1], weights_[2], lit, undrawable);
        const std::vector<Real> ends = marginal_.download();
        const std::vector<cl_uint> lit_of = lit.download();
        const std::vector<cl_uint> undrawable_of = undrawable.download();
        constexpr Real range = 4294967296;
        for (std::size_t i = 0; i < ends.size(); ++i) {
            const Real start = i == 0 ? 0 : ends[i - 1];
            const bool row_drawable = std::ceil(start * range) < ends[i] * range;
            report.lit += lit_of[i];
            report.undrawable += row_drawable ? undrawable_of[i] : lit_of[i];
        }
    }

    [[nodiscard]] std::vector<Real> marginal() const { return marginal_.download(); }
    [[nodiscard]] Real total() const { return sum_.download()[0]; }

  private:
    [[nodiscard]] Range rows() const { return device_.fat(map_.height); }

    const Device& device_;
    const DeviceMap& map_;
    std::array<float, 3> weights_;
    Program program_;
    Floats sine_;
    Buffer<Real> totals_;
    Buffer<Real> marginal_;
    Buffer<Real> sum_;
    Kernel<Floats, Floats, cl_uint, cl_uint, cl_float, cl_float, cl_float, Buffer<Real>> sum_rows_{device_, program_,
                                                                                                   "sum_rows"};
    Kernel<Buffer<Real>, cl_uint, Buffer<Real>, Buffer<Real>> scan_sums_{device_, program_, "scan_sums"};
    Kernel<Floats, Floats, Buffer<Real>, cl_uint, cl_uint, cl_float, cl_float, cl_float, Buffer<Real>> scan_rows_{
        device_, program_, "scan_rows"};
    Kernel<Floats, Floats, Buffer<Real>, cl_uint, cl_uint, cl_float, cl_float, cl_float, Uints, Uints>
        count_undrawable_{device_, program_, "count_undrawable"};
};

/// Exact weights of a map, and their exact sum.
struct ExactWeights {
    std::vector<long double> weight;  ///< [height * width], 0 where a component is bad
    long double sum = 0;
};

ExactWeights exact_weights(const DeviceMap& map, Luminance luminance) {
    const std::array<float, 3> share = luminance_weights_f32(luminance);
    const std::vector<float> radiance = map.radiance.download();
    const std::vector<float> sine = row_geometry(map.width, map.height).sine;
    ExactWeights exact;
    exact.weight.resize(map.width * map.height);
    ExactSum sum;
    for (std::size_t at = 0; at < exact.weight.size(); ++at) {
        const float* texel = radiance.data() + 3 * at;
        if (!std::all_of(texel, texel + 3, [](float v) { return v >= 0 && std::isfinite(v); })) continue;
        const float s = sine[at / map.width];
        long double intensity = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            sum.add_product(texel[c], share[c], s);
            intensity += static_cast<long double>(texel[c]) * static_cast<long double>(share[c]);
        }
        exact.weight[at] = intensity * static_cast<long double>(s);
    }
    exact.sum = sum.value();
    return exact;
}

/// Errors of `probability`, a function of the texel's index, against the exact weights.
template <class Probability>
void hold_against(const ExactWeights& exact, const Probability& probability, ArithmeticReport& report) {
    long double variation = 0;
    for (std::size_t at = 0; at < exact.weight.size(); ++at) {
        const long double wanted = exact.weight[at] / exact.sum;
        const long double error = std::abs(static_cast<long double>(probability(at)) - wanted);
        variation += error;
        if (wanted > 0) {
            report.largest_relative_error =
                std::max(report.largest_relative_error, static_cast<double>(error / wanted));
        }
    }
    report.total_variation = static_cast<double>(variation / 2);
}

double relative_error(long double value, long double exact) {
    return exact == 0 ? 0 : static_cast<double>(std::abs(value - exact) / exact);
}

void require_float64(const Device& device) {
    if (device.traits().fp64) return;
    throw DeviceError("device " + device.info().name + " has no float64: choose another --table-arithmetic than f64");
}

/// Ends of tables of `count` entries each, given as fractions, in units of 2^-TABLE_BITS and never descending.
///   ends [tables * count]
template <class Real>
std::vector<cl_uint> whole_ends(const std::vector<Real>& ends, std::size_t count) {
    std::vector<cl_uint> whole(ends.size());
    for (std::size_t at = 0; at < ends.size(); ++at) {
        const auto end = static_cast<double>(ends[at]);
        if (!std::isfinite(end)) {
            throw InputError(
                "the map's weights add up to more, or to less, than this --table-arithmetic holds; integer holds any");
        }
        const auto rounded = static_cast<cl_uint>(std::llround(std::clamp(std::ldexp(end, TABLE_BITS), 0.0, ONE)));
        whole[at] = at % count == 0 ? rounded : std::max(whole[at - 1], rounded);
    }
    return whole;
}

template <class Real>
void use_real(const Device& device, const DeviceMap& map, Luminance luminance, bool compensated,
              Distribution& distribution) {
    RealTables<Real> tables(device, map, luminance, compensated);
    Buffer<Real> columns(device, "the conditional tables", map.width * map.height);
    tables.sum();
    tables.scan(columns);
    distribution.marginal.upload(whole_ends(tables.marginal(), map.height));
    distribution.conditional.upload(whole_ends(columns.download(), map.width));
}

template <class Real>
void measure_real(const Device& device, const DeviceMap& map, Luminance luminance, bool compensated,
                  ArithmeticReport& report) {
    RealTables<Real> tables(device, map, luminance, compensated);
    Buffer<Real> table(device, "the conditional tables", map.width * map.height);
    tables.sum();
    tables.scan(table);  // compiles for this size; the second run is the one timed
    const Stopwatch building;
    tables.sum();
    tables.scan(table);
    report.seconds = building.seconds();
    tables.count(report);

    const ExactWeights exact = exact_weights(map, luminance);
    const std::vector<Real> columns = table.download();
    const std::vector<Real> rows = tables.marginal();
    const auto width_in = [](const std::vector<Real>& ends, std::size_t at, bool first) {
        return static_cast<long double>(ends[at]) - (first ? 0 : static_cast<long double>(ends[at - 1]));
    };
    hold_against(
        exact,
        [&](std::size_t at) {
            const std::size_t row = at / map.width;
            return width_in(rows, row, row == 0) * width_in(columns, at, at % map.width == 0);
        },
        report);
    report.total_relative_error = relative_error(static_cast<long double>(tables.total()), exact.sum);
}

void measure_integer(const Device& device, const DeviceMap& map, Luminance luminance, ArithmeticReport& report) {
    TableBuilder builder(device);
    const TableOptions options{luminance, ScanPath::automatic};
    (void)builder.build(map, options);  // as in measure_real
    const Stopwatch building;
    const Distribution distribution = builder.build(map, options);
    report.seconds = building.seconds();

    const ExactWeights exact = exact_weights(map, luminance);
    const std::vector<double> probabilities = texel_probabilities(distribution);
    report.lit = map.width * map.height - distribution.counts.zero;
    const auto drawable = std::count_if(probabilities.begin(), probabilities.end(), [](double p) { return p > 0; });
    report.undrawable = report.lit - static_cast<std::uint64_t>(drawable);
    hold_against(
        exact, [&](std::size_t at) { return probabilities[at]; }, report);
    // phi is the sum of weights times the solid angle of a texel over its row's sine, the same for all rows.
    const double per_weight =
        texel_solid_angles(map.width, map.height)[0] / row_geometry(map.width, map.height).sine[0];
    report.total_relative_error = relative_error(static_cast<long double>(distribution.phi / per_weight), exact.sum);
}

const NamedValues<TableArithmetic>& arithmetics() {
    static const NamedValues<TableArithmetic> all("table arithmetic",
                                                  {{TableArithmetic::f32, "f32"},
                                                   {TableArithmetic::f32_compensated, "f32-compensated"},
                                                   {TableArithmetic::f64, "f64"},
                                                   {TableArithmetic::integer, "integer"}});
    return all;
}

}  // namespace

std::string name_of(TableArithmetic arithmetic) { return arithmetics().name_of(arithmetic); }
std::vector<std::string> table_arithmetic_names() { return arithmetics().names(); }
TableArithmetic table_arithmetic_by_name(std::string_view name) { return arithmetics().by_name(name); }

ArithmeticReport measure_table_arithmetic(const Device& device, const DeviceMap& map, Luminance luminance,
                                          TableArithmetic arithmetic) {
    ArithmeticReport report;
    report.arithmetic = arithmetic;
    if (arithmetic == TableArithmetic::integer) {
        measure_integer(device, map, luminance, report);
    } else if (arithmetic == TableArithmetic::f64) {
        require_float64(device);
        measure_real<double>(device, map, luminance, false, report);
    } else {
        measure_real<float>(device, map, luminance, arithmetic == TableArithmetic::f32_compensated, report);
    }
    return report;
}

void use_arithmetic(const Device& device, TableBuilder& builder, const DeviceMap& map, Luminance luminance,
                    TableArithmetic arithmetic, Distribution& distribution) {
    if (arithmetic == TableArithmetic::integer || distribution.black()) return;
    if (arithmetic == TableArithmetic::f64) {
        require_float64(device);
        use_real<double>(device, map, luminance, false, distribution);
    } else {
        use_real<float>(device, map, luminance, arithmetic == TableArithmetic::f32_compensated, distribution);
    }
    builder.build_guides(distribution);
}

std::uint64_t undrawable_f32(const Device& device, const DeviceMap& map, Luminance luminance) {
    RealTables<float> tables(device, map, luminance, false);
    ArithmeticReport report;
    tables.sum();
    tables.count(report);
    return report.undrawable;
}

}  // namespace clerestory
