#include "distribution.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"

namespace clerestory {
namespace {

// A guide of a quarter of a row's texels leaves two halvings on an even map and costs 1 byte a texel.
constexpr unsigned COLUMN_GUIDE_SHRINK = 2;
// Four entries a row: most of them lie within one row, and all of them in a core's own cache.
constexpr unsigned ROW_GUIDE_GROWTH = 2;
// Rows a compute unit should have before whole rows share the work out evenly.
constexpr std::size_t ROWS_PER_UNIT = 8;

unsigned bits_to_count(std::size_t count) { return static_cast<unsigned>(std::bit_width(count - 1)); }

/// `spare` where it has the right size, else a new array.
Uints sized(const Device& device, const char* name, std::size_t count, Uints spare) {
    if (spare.size() == count) return spare;
    spare = {};  // before the new one is taken
    return {device, name, count};
}

using Censuses = Buffer<Census>;
using Weights = Buffer<RowWeight>;

}  // namespace

DeviceMap::DeviceMap(const Device& device, const RadianceMap& map)
    : width(map.width),
      height(map.height),
      radiance(Floats::over(device, "the map", {map.rgb.data(), map.rgb.size()})) {}

struct TableBuilder::State {
    explicit State(const Device& opened) : device(opened) {}

    /// Kernels that weigh rows cut into chunks. Whole rows are weighed by build_rows.
    struct Stage1 {
        explicit Stage1(const Device& opened) : device(opened) {}

        const Device& device;
        Program program{device, "stage1_weight.cl"};
        Kernel<Floats, cl_uint, cl_uint, cl_uint, Censuses> census_chunks{device, program, "census_chunks"};
        Kernel<Censuses, cl_uint, cl_uint, cl_uint, Censuses> join_census{device, program, "join_census"};
        Kernel<Floats, Censuses, cl_uint, cl_uint, cl_uint, cl_float, cl_float, cl_float, Weights> sum_chunks{
            device, program, "sum_chunks"};
        Kernel<Weights, cl_uint, cl_uint, Weights> join_weights{device, program, "join_weights"};
    };

    const Device& device;
    std::size_t local_bytes = device.handle().getInfo<CL_DEVICE_LOCAL_MEM_SIZE>();
    std::optional<Stage1> built_stage1;
    Program stage2{device, "stage2_cdf.cl"};
    Kernel<Floats, cl_uint, cl_uint, cl_uint, cl_float, cl_float, cl_float, cl_uint, Censuses, Weights, Uints, Uints,
           LocalArray<cl_float16>>
        build_rows{device, stage2, "build_rows"};
    Kernel<Floats, Censuses, Weights, cl_uint, cl_uint, cl_uint, cl_float, cl_float, cl_float, Uints, Uints>
        scan_chunks{device, stage2, "scan_chunks"};
    Kernel<Uints, cl_uint, cl_uint, Uints, Uints> scan_totals{device, stage2, "scan_totals"};
    Kernel<Uints, Uints, cl_uint, cl_uint, cl_uint, Uints> finish_chunks{device, stage2, "finish_chunks"};
    Kernel<Weights, Floats, cl_uint, Buffer<cl_ulong>, Uints> scan_marginal{device, stage2, "scan_marginal"};
    Kernel<Uints, cl_uint, cl_uint, cl_uint, Uints> build_guides{device, stage2, "build_guides"};

    /// Built when first asked for: compiling it would be part of every first run.
    Stage1& stage1() { return built_stage1 ? *built_stage1 : built_stage1.emplace(device); }

    /// Range of one work-item per row or chunk: few fat items, so small groups.
    [[nodiscard]] Range fat(std::size_t count) const { return {count, device.work_group(1)}; }
    [[nodiscard]] Range thin(std::size_t count) const { return {count, device.work_group(64)}; }

    void count(const DeviceMap& map, std::size_t chunks, Censuses& rows) {
        Censuses parts(device, "the chunks' census", map.height * chunks);
        stage1().census_chunks(fat(parts.size()), map.radiance, narrow(map.width), narrow(chunks), narrow(parts.size()),
                               parts);
        stage1().join_census(thin(map.height), parts, narrow(map.width), narrow(chunks), narrow(map.height), rows);
        device.finish();
    }

    void build_by_chunks(const DeviceMap& map, UnfinishedTables& tables) {
        const auto luminance = luminance_weights_f32(tables.options.luminance);
        auto& [options, built, censuses, weights] = tables;
        Uints& conditional = built.conditional;
        const std::size_t chunks = chunks_of(map.width);
        const std::size_t items = map.height * chunks;
        count(map, chunks, censuses);
        Weights parts(device, "the chunks' weights", items);
        Uints totals(device, "the chunks' totals", items);
        Uints starts(device, "the chunks' starts", items);
        Uints row_totals(device, "the rows' totals", map.height);
        const auto w = narrow(map.width);
        const auto c = narrow(chunks);
        const auto n = narrow(items);
        const auto h = narrow(map.height);
        stage1().sum_chunks(fat(items), map.radiance, censuses, w, c, n, luminance[0], luminance[1], luminance[2],
                            parts);
        stage1().join_weights(thin(map.height), parts, c, h, weights);
        scan_chunks(fat(items), map.radiance, censuses, weights, w, c, n, luminance[0], luminance[1], luminance[2],
                    totals, conditional);
        scan_totals(thin(map.height), totals, c, h, starts, row_totals);
        finish_chunks(fat(items), starts, row_totals, w, c, n, conditional);
        build_guides(thin(built.conditional_guide.size()), conditional, w, h, built.column_bits,
                     built.conditional_guide);
        device.finish();
    }

    void build_by_rows(const DeviceMap& map, std::size_t begin, std::size_t end, UnfinishedTables& tables) {
        const auto luminance = luminance_weights_f32(tables.options.luminance);
        auto& [options, built, censuses, weights] = tables;
        build_rows({end - begin, 1}, map.radiance, narrow(map.width), narrow(begin), narrow(end - begin), luminance[0],
                   luminance[1], luminance[2], built.column_bits, censuses, weights, built.conditional,
                   built.conditional_guide, row_space(map.width));
        device.finish();
    }

    [[nodiscard]] static std::size_t chunks_of(std::size_t width) { return (width + CHUNK_TEXELS - 1) / CHUNK_TEXELS; }

    /// A row's intensities, by sixteen.
    [[nodiscard]] static LocalArray<cl_float16> row_space(std::size_t width) { return {(width + 15) / 16}; }

    [[nodiscard]] bool by_chunks(const UnfinishedTables& tables) const {
        const ScanPath path = tables.options.path;
        const auto [width, height] = std::pair(tables.built.width, tables.built.height);
        if (row_space(width).count * sizeof(cl_float16) > local_bytes) return true;
        if (path != ScanPath::automatic) return path == ScanPath::chunks;
        return !device.info().is_cpu || height < ROWS_PER_UNIT * device.info().compute_units;
    }
};

TableBuilder::TableBuilder(const Device& device) : state_(std::make_unique<State>(device)) {}
TableBuilder::TableBuilder(TableBuilder&&) noexcept = default;
TableBuilder& TableBuilder::operator=(TableBuilder&&) noexcept = default;
TableBuilder::~TableBuilder() = default;

MapCensus TableBuilder::census(const DeviceMap& map) {
    Censuses rows(state_->device, "the rows' census", map.height);
    state_->count(map, State::chunks_of(map.width), rows);
    return clerestory::join_census(rows.download(), map.width);
}

Distribution TableBuilder::build(const DeviceMap& map, const TableOptions& options, Distribution spare) {
    UnfinishedTables tables = start(map.width, map.height, options, std::move(spare));
    add_rows(tables, map, 0, map.height);
    return finish(std::move(tables), map);
}

UnfinishedTables TableBuilder::start(std::size_t width, std::size_t height, const TableOptions& options,
                                     Distribution spare) {
    const Device& device = state_->device;
    UnfinishedTables tables;
    tables.options = options;
    Distribution& built = tables.built;
    built.width = width;
    built.height = height;
    built.row_bits = bits_to_count(height) + ROW_GUIDE_GROWTH;
    built.column_bits = std::max(bits_to_count(width), COLUMN_GUIDE_SHRINK) - COLUMN_GUIDE_SHRINK;
    const std::size_t column_entries = ((std::size_t{1} << built.column_bits) + 1) * height;
    built.conditional = sized(device, "the conditional tables", width * height, std::move(spare.conditional));
    built.conditional_guide = sized(device, "the rows' guides", column_entries, std::move(spare.conditional_guide));
    tables.censuses = Censuses(device, "the rows' census", height);
    tables.weights = Weights(device, "the rows' weights", height);
    return tables;
}

void TableBuilder::add_rows(UnfinishedTables& tables, const DeviceMap& map, std::size_t begin, std::size_t end) {
    if (!state_->by_chunks(tables)) state_->build_by_rows(map, begin, end, tables);
}

Distribution TableBuilder::finish(UnfinishedTables tables, const DeviceMap& map) {
    State& s = *state_;
    if (s.by_chunks(tables)) s.build_by_chunks(map, tables);
    auto& [options, built, censuses, weights] = tables;
    built.census = join_census(censuses.download(), map.width);
    if (built.census.bad() != 0) {
        throw InputError(describe_bad_texels(built.census) + "; --bad-texels zero blackens them");
    }

    const RowGeometry geometry = row_geometry(map.width, map.height);
    built.frames = Buffer<RowFrame>(s.device, "the rows' frames", std::span<const RowFrame>(geometry.frames));
    const Floats sines(s.device, "the rows' sines", std::span<const float>(geometry.sine));
    Buffer<cl_ulong> shares(s.device, "the rows' shares", map.height);
    built.marginal = Uints(s.device, "the marginal table", map.height);
    s.scan_marginal({1, 1}, weights, sines, narrow(map.height), shares, built.marginal);

    const std::size_t row_entries = (std::size_t{1} << built.row_bits) + 1;
    built.marginal_guide = Uints(s.device, "the marginal's guide", row_entries);
    s.build_guides(s.thin(row_entries), built.marginal, narrow(map.height), 1U, built.row_bits, built.marginal_guide);

    built.exponent = -126;  // the least that a row can have
    const std::vector<double> solid_angles = texel_solid_angles(map.width, map.height);
    const std::vector<RowWeight> rows = weights.download();
    for (std::size_t i = 0; i < rows.size(); ++i) {
        if (rows[i].lit == 0) continue;
        built.exponent = std::max(built.exponent, rows[i].exponent);
        built.phi += solid_angles[i] * std::ldexp(static_cast<double>(rows[i].sum), rows[i].exponent - WEIGHT_BITS);
    }
    if (built.black()) built.exponent = 0;
    s.device.finish();
    return std::move(built);
}

void TableBuilder::build_guides(Distribution& d) {
    State& s = *state_;
    s.build_guides(s.thin(d.conditional_guide.size()), d.conditional, narrow(d.width), narrow(d.height), d.column_bits,
                   d.conditional_guide);
    s.build_guides(s.thin(d.marginal_guide.size()), d.marginal, narrow(d.height), 1U, d.row_bits, d.marginal_guide);
    s.device.finish();
}

std::vector<double> texel_solid_angles(std::size_t width, std::size_t height) {
    constexpr double pi = std::numbers::pi;
    const auto h = static_cast<double>(height);
    const double factor = 2 * pi / static_cast<double>(width) * 2 * std::sin(pi / (2 * h));
    std::vector<double> angles(height);
    for (std::size_t i = 0; i < height; ++i) {
        const auto from_pole = static_cast<double>(std::min(i, height - 1 - i));
        angles[i] = factor * std::sin(pi * (from_pole + 0.5) / h);
    }
    return angles;
}

std::vector<double> texel_probabilities(const Distribution& distribution) {
    const std::vector<cl_uint> rows = distribution.marginal.download();
    const std::vector<cl_uint> columns = distribution.conditional.download();
    std::vector<double> probabilities(columns.size());
    const double unit = std::ldexp(1.0, -2 * TABLE_BITS);
    for (std::size_t i = 0; i < distribution.height; ++i) {
        const double row = static_cast<double>(rows[i] - (i == 0 ? 0 : rows[i - 1])) * unit;
        for (std::size_t j = 0; j < distribution.width; ++j) {
            const std::size_t at = i * distribution.width + j;
            probabilities[at] = row * static_cast<double>(columns[at] - (j == 0 ? 0 : columns[at - 1]));
        }
    }
    return probabilities;
}

}  // namespace clerestory
