#include "sampling/sample_records.hpp"

#include <fmt/format.h>
#include "map/latlong.hpp"

#include <cmath>
#include <iterator>
#include <numbers>

namespace clerestory {
namespace {

cl_uint table_width(const std::vector<cl_uint>& table, std::size_t first, std::size_t at) {
    return table[first + at] - (at == 0 ? 0 : table[first + at - 1]);
}

}  // namespace

std::vector<SampleRecord> sample_records(const SampleSet& set, const Distribution& distribution) {
    const auto texels = set.texel.download();
    const auto directions = set.direction.download();
    const auto radiances = set.radiance.download();
    const auto rows = distribution.marginal.download();
    const auto columns = distribution.conditional.download();
    const auto solid_angles = texel_solid_angles(distribution.width, distribution.height);
    std::vector<SampleRecord> records(set.count);
    for (std::size_t i = 0; i < set.count; ++i) {
        SampleRecord& record = records[i];
        record.row = texels[i] / distribution.width;
        record.column = texels[i] % distribution.width;
        for (std::size_t c = 0; c < 3; ++c) {
            record.direction[c] = directions[c * set.count + i];
            record.rgb[c] = radiances[c * set.count + i];
        }
        const auto x = static_cast<double>(record.direction[0]);
        const auto y = static_cast<double>(record.direction[1]);
        const auto z = static_cast<double>(record.direction[2]);
        record.theta = std::atan2(std::hypot(x, z), y);
        const double phi = std::atan2(z, x);
        record.phi = phi < 0 ? phi + 2 * std::numbers::pi : phi;
        const double row = table_width(rows, 0, record.row);
        const double column = table_width(columns, record.row * distribution.width, record.column);
        record.pdf = std::ldexp(row * column, -2 * TABLE_BITS) / solid_angles[record.row];
    }
    return records;
}

std::string samples_csv(const std::vector<SampleRecord>& records) {
    std::string out = "index,row,column,theta,phi,x,y,z,pdf,r,g,b\n";
    auto to = std::back_inserter(out);
    for (std::size_t i = 0; i < records.size(); ++i) {
        const SampleRecord& s = records[i];
        fmt::format_to(to, "{},{},{},{},{},{},{},{},{},{},{},{}\n", i, s.row, s.column, s.theta, s.phi, s.direction[0],
                       s.direction[1], s.direction[2], s.pdf, s.rgb[0], s.rgb[1], s.rgb[2]);
    }
    return out;
}

}  // namespace clerestory
