#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "cl/device.hpp"
#include "options.hpp"
#include "tables/stage2_cdf.hpp"

namespace clerestory {

/// The arithmetic of cumulative tables. Renders use `integer`; the others are there to be compared with it.
enum class TableArithmetic {
    f32,              ///< float32 running sums over their last, what most renderers do
    f32_compensated,  ///< the same with Kahan's correction: the sums are right, the tables still float32
    f64,              ///< float64 running sums over their last
    integer,          ///< the tables of TableBuilder
};
inline constexpr std::array<TableArithmetic, 4> TABLE_ARITHMETICS = {
    TableArithmetic::f32, TableArithmetic::f32_compensated, TableArithmetic::f64, TableArithmetic::integer};

/// Its name at the command line and in reports.
std::string name_of(TableArithmetic arithmetic);
std::vector<std::string> table_arithmetic_names();
TableArithmetic table_arithmetic_by_name(std::string_view name);

/// How one arithmetic does on one map. Bad texels count as black.
struct ArithmeticReport {
    TableArithmetic arithmetic = TableArithmetic::integer;
    std::uint64_t lit = 0;              ///< texels with any light
    std::uint64_t undrawable = 0;       ///< of these, what no 32-bit random number draws
    double largest_relative_error = 0;  ///< of a lit texel's probability in the table, against the exact one
    double total_variation = 0;         ///< half the sum of all texels' absolute errors of probability
    double total_relative_error = 0;    ///< of the sum of weights, against the exact sum
    double seconds = 0;                 ///< to build the tables, compilation left out
};

/// Builds the tables of a map in one arithmetic and holds them against exact sums. Throws DeviceError where the device
/// lacks float64 for `f64`, InputError as TableBuilder does for `integer`.
ArithmeticReport measure_table_arithmetic(const Device& device, const DeviceMap& map, Luminance luminance,
                                          TableArithmetic arithmetic);

/// Puts the tables of another arithmetic, rounded to the nearest 2^-TABLE_BITS, in the place of a distribution's own:
/// to see what its errors do to samples and pictures. The density stays that of the tables drawn from, so texels that
/// the arithmetic lost are missing from every estimate. Throws InputError where its sums leave their range, DeviceError
/// where the device lacks float64 for `f64`.
void use_arithmetic(const Device& device, TableBuilder& builder, const DeviceMap& map, Luminance luminance,
                    TableArithmetic arithmetic, Distribution& distribution);

/// How many lit texels float32 running sums over their last would leave without any 32-bit random number.
std::uint64_t undrawable_f32(const Device& device, const DeviceMap& map, Luminance luminance);

}  // namespace clerestory
