#include "tables/stage2_cdf.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"
#include "map/latlong.hpp"
#include "map/luminance.hpp"

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

/// Throws DeviceError: a device that takes small numbers for 0 would take lit texels for black ones.
void refuse_denormals(const Device& device, const RadianceMap& map) {
    const auto is_denormal = [](float v) { return std::fpclassify(v) == FP_SUBNORMAL; };
    const float* const end = map.rgb.data() + map.rgb.size();
    const float* const first = std::find_if(map.rgb.data(), end, is_denormal);
    if (first == end) return;
    const auto texel = static_cast<std::size_t>(first - map.rgb.data()) / 3;
    throw DeviceError(fmt::format(
        "device {} takes numbers below 1.2e-38 for 0, and the map holds {}, the first at row {}, column {}: choose "
        "another with --device, or multiply the map",
        device.info().name, std::count_if(first, end, is_denormal), texel / map.width, texel % map.width));
}

using TexelCountsBuffer = Buffer<TexelCounts>;
using Weights = Buffer<RowWeight>;

}  // namespace

DeviceMap::DeviceMap(const Device& device, const RadianceMap& map)
    : width(map.width),
      height(map.height),
      radiance(Floats::over(device, "the map", {map.rgb.data(), map.rgb.size()})) {
    if (!device.traits().denormals) refuse_denormals(device, map);
}

using Ulongs = Buffer<cl_ulong>;
using Ints = Buffer<cl_int>;

// Parts of TableBuilder::State, which no unnamed namespace may hold where several files are compiled as one.

/// What joins chunks to rows, whoever weighed them.
struct JoinKernels {
    explicit JoinKernels(const Device& device)
        : stage1(device, "stage1_weight.cl"),
          join_counts(device, stage1, "join_counts"),
          join_weights(device, stage1, "join_weights") {}

    Program stage1;
    Kernel<TexelCountsBuffer, cl_uint, cl_uint, cl_uint, TexelCountsBuffer> join_counts;
    Kernel<Weights, cl_uint, cl_uint, Weights> join_weights;
};

/// Kernels in which a fat work-item takes a chunk.
struct ChunkKernels {
    ChunkKernels(const Device& device, const Program& stage1, const Program& stage2)
        : count_chunks(device, stage1, "count_chunks"),
          sum_chunks(device, stage1, "sum_chunks"),
          scan_chunks(device, stage2, "scan_chunks"),
          finish_chunks(device, stage2, "finish_chunks") {}

    Kernel<Floats, cl_uint, cl_uint, cl_uint, TexelCountsBuffer> count_chunks;
    Kernel<Floats, TexelCountsBuffer, cl_uint, cl_uint, cl_uint, cl_float, cl_float, cl_float, Weights> sum_chunks;
    Kernel<Floats, TexelCountsBuffer, Weights, cl_uint, cl_uint, cl_uint, cl_float, cl_float, cl_float, Uints, Uints>
        scan_chunks;
    Kernel<Uints, Uints, cl_uint, cl_uint, cl_uint, Uints> finish_chunks;
};

/// Kernels in which a group of work-items in lock step takes a chunk, or a tile of the marginal.
struct GroupKernels {
    explicit GroupKernels(const Device& opened) : device(opened) {}

    const Device& device;
    Program program{device, "stage2_groups.cl", fmt::format("-DSCAN_LANES={}u", device.traits().scan_lanes)};
    Kernel<Floats, cl_uint, cl_uint, TexelCountsBuffer> count_groups{device, program, "count_groups"};
    Kernel<Floats, TexelCountsBuffer, cl_uint, cl_uint, cl_float, cl_float, cl_float, Weights> sum_groups{
        device, program, "sum_groups"};
    Kernel<Floats, TexelCountsBuffer, Weights, cl_uint, cl_uint, cl_float, cl_float, cl_float, Uints, Uints>
        scan_groups{device, program, "scan_groups"};
    Kernel<Uints, Uints, cl_uint, cl_uint, cl_uint, Uints> finish_texels{device, program, "finish_texels"};
    Kernel<Weights, Floats, cl_uint, Ulongs, Ints, Ulongs> share_rows{device, program, "share_rows"};
    Kernel<Ints, cl_uint, Ints> find_largest{device, program, "find_largest"};
    Kernel<Ints, Ints, cl_uint, Ulongs> cut_shares{device, program, "cut_shares"};
    Kernel<Ulongs, cl_uint, Ulongs> scan_tiles{device, program, "scan_tiles"};
    Kernel<Ulongs, cl_uint, Ulongs> add_tiles{device, program, "add_tiles"};
    Kernel<Ulongs, Ulongs, cl_uint, Uints> finish_marginal{device, program, "finish_marginal"};

    /// Replaces the numbers by their running sums: tile by tile, then the tiles' totals in the same way.
    void scan(Ulongs& values) {
        const std::size_t tiles = (values.size() - 1) / device.traits().scan_lanes + 1;
        Ulongs totals(device, "the tiles' totals", tiles);
        scan_tiles(device.scanning(tiles), values, narrow(values.size()), totals);
        if (tiles == 1) return;
        scan(totals);
        add_tiles(device.thin(values.size()), totals, narrow(values.size()), values);
    }

    void scan_marginal(const Weights& weights, const Floats& sines, Uints& marginal) {
        const std::size_t height = marginal.size();
        const auto h = narrow(height);
        Ulongs shares(device, "the rows' shares", height);
        Ulongs lit(device, "the lit rows", height);
        Ints exponents(device, "the shares' exponents", height);
        Ints largest(device, "the largest exponent", 1);
        share_rows(device.thin(height), weights, sines, h, shares, exponents, lit);
        find_largest(device.scanning(1), exponents, h, largest);
        cut_shares(device.thin(height), exponents, largest, h, shares);
        scan(shares);
        scan(lit);
        finish_marginal(device.thin(height), shares, lit, h, marginal);
    }
};

struct TableBuilder::State {
    explicit State(const Device& opened) : device(opened) {
        if (device.traits().fat_items) {
            build_rows.emplace(device, stage2, "build_rows");
            scan_marginal.emplace(device, stage2, "scan_marginal");
        } else {
            groups.emplace(device);
        }
    }

    const Device& device;
    Program stage2{device, "stage2_cdf.cl"};
    Kernel<Uints, cl_uint, cl_uint, Uints, Uints> scan_totals{device, stage2, "scan_totals"};
    Kernel<Uints, cl_uint, cl_uint, cl_uint, Uints> build_guides{device, stage2, "build_guides"};
    using BuildRows = Kernel<Floats, cl_uint, cl_uint, cl_uint, cl_float, cl_float, cl_float, cl_uint,
                             TexelCountsBuffer, Weights, Uints, Uints, LocalArray<cl_float16>>;
    std::optional<BuildRows> build_rows;
    std::optional<Kernel<Weights, Floats, cl_uint, Ulongs, Uints>> scan_marginal;
    std::optional<GroupKernels> groups;  ///< where work-items run in lock step
    std::optional<JoinKernels> built_joins;
    std::optional<ChunkKernels> built_chunks;

    /// Built when first asked for, as the next: maps whose rows are built whole need neither.
    JoinKernels& joins() { return built_joins ? *built_joins : built_joins.emplace(device); }
    ChunkKernels& chunked() {
        return built_chunks ? *built_chunks : built_chunks.emplace(device, joins().stage1, stage2);
    }

    void count(const DeviceMap& map, std::size_t chunks, TexelCountsBuffer& rows) {
        const auto w = narrow(map.width);
        const auto c = narrow(chunks);
        TexelCountsBuffer parts(device, "the chunks' counts", map.height * chunks);
        if (groups) {
            groups->count_groups(device.scanning(parts.size()), map.radiance, w, c, parts);
        } else {
            chunked().count_chunks(device.fat(parts.size()), map.radiance, w, c, narrow(parts.size()), parts);
        }
        joins().join_counts(device.thin(map.height), parts, w, c, narrow(map.height), rows);
        device.finish();
    }

    void build_by_chunks(const DeviceMap& map, UnfinishedTables& tables) {
        const auto [r, g, b] = luminance_weights_f32(tables.options.luminance);
        auto& [options, built, counts, weights] = tables;
        Uints& conditional = built.conditional;
        const std::size_t chunks = chunks_of(map.width);
        const std::size_t items = map.height * chunks;
        count(map, chunks, counts);
        Weights parts(device, "the chunks' weights", items);
        Uints totals(device, "the chunks' totals", items);
        Uints starts(device, "the chunks' starts", items);
        Uints row_totals(device, "the rows' totals", map.height);
        const auto w = narrow(map.width);
        const auto c = narrow(chunks);
        const auto n = narrow(items);
        const auto h = narrow(map.height);
        if (groups) {
            groups->sum_groups(device.scanning(items), map.radiance, counts, w, c, r, g, b, parts);
            joins().join_weights(device.thin(map.height), parts, c, h, weights);
            groups->scan_groups(device.scanning(items), map.radiance, counts, weights, w, c, r, g, b, totals,
                                conditional);
            scan_totals(device.thin(map.height), totals, c, h, starts, row_totals);
            groups->finish_texels(device.thin(conditional.size()), starts, row_totals, w, c, narrow(conditional.size()),
                                  conditional);
        } else {
            chunked().sum_chunks(device.fat(items), map.radiance, counts, w, c, n, r, g, b, parts);
            joins().join_weights(device.thin(map.height), parts, c, h, weights);
            chunked().scan_chunks(device.fat(items), map.radiance, counts, weights, w, c, n, r, g, b, totals,
                                  conditional);
            scan_totals(device.thin(map.height), totals, c, h, starts, row_totals);
            chunked().finish_chunks(device.fat(items), starts, row_totals, w, c, n, conditional);
        }
        build_guides(device.thin(built.conditional_guide.size()), conditional, w, h, built.column_bits,
                     built.conditional_guide);
        device.finish();
    }

    void build_by_rows(const DeviceMap& map, std::size_t begin, std::size_t end, UnfinishedTables& tables) {
        const auto luminance = luminance_weights_f32(tables.options.luminance);
        auto& [options, built, counts, weights] = tables;
        (*build_rows)({end - begin, 1}, map.radiance, narrow(map.width), narrow(begin), narrow(end - begin),
                      luminance[0], luminance[1], luminance[2], built.column_bits, counts, weights, built.conditional,
                      built.conditional_guide, row_space(map.width));
        device.finish();
    }

    void build_marginal(const Weights& weights, const Floats& sines, Uints& marginal) {
        if (groups) {
            groups->scan_marginal(weights, sines, marginal);
            return;
        }
        Ulongs shares(device, "the rows' shares", marginal.size());
        (*scan_marginal)(device.single(), weights, sines, narrow(marginal.size()), shares, marginal);
    }

    [[nodiscard]] static std::size_t chunks_of(std::size_t width) { return (width + CHUNK_TEXELS - 1) / CHUNK_TEXELS; }

    /// A row's intensities, by sixteen.
    [[nodiscard]] static LocalArray<cl_float16> row_space(std::size_t width) { return {(width + 15) / 16}; }

    [[nodiscard]] bool by_chunks(const UnfinishedTables& tables) const {
        const ScanPath path = tables.options.path;
        const auto [width, height] = std::pair(tables.built.width, tables.built.height);
        if (!build_rows || row_space(width).count * sizeof(cl_float16) > device.traits().local_bytes) return true;
        if (path != ScanPath::automatic) return path == ScanPath::chunks;
        return height < ROWS_PER_UNIT * device.info().compute_units;
    }
};

TableBuilder::TableBuilder(const Device& device) : state_(std::make_unique<State>(device)) {}
TableBuilder::TableBuilder(TableBuilder&&) noexcept = default;
TableBuilder& TableBuilder::operator=(TableBuilder&&) noexcept = default;
TableBuilder::~TableBuilder() = default;

MapCounts TableBuilder::count_texels(const DeviceMap& map) {
    TexelCountsBuffer rows(state_->device, "the rows' counts", map.height);
    state_->count(map, State::chunks_of(map.width), rows);
    return clerestory::join_counts(rows.download(), map.width);
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
    tables.counts = TexelCountsBuffer(device, "the rows' counts", height);
    tables.weights = Weights(device, "the rows' weights", height);
    return tables;
}

void TableBuilder::add_rows(UnfinishedTables& tables, const DeviceMap& map, std::size_t begin, std::size_t end) {
    if (!state_->by_chunks(tables)) state_->build_by_rows(map, begin, end, tables);
}

Distribution TableBuilder::finish(UnfinishedTables tables, const DeviceMap& map) {
    State& s = *state_;
    if (s.by_chunks(tables)) s.build_by_chunks(map, tables);
    auto& [options, built, counts, weights] = tables;
    built.counts = clerestory::join_counts(counts.download(), map.width);
    if (built.counts.bad() != 0) {
        throw InputError(describe_bad_texels(built.counts) + "; --bad-texels zero blackens them");
    }

    const RowGeometry geometry = row_geometry(map.width, map.height);
    built.frames = Buffer<RowFrame>(s.device, "the rows' frames", std::span<const RowFrame>(geometry.frames));
    const Floats sines(s.device, "the rows' sines", std::span<const float>(geometry.sine));
    built.marginal = Uints(s.device, "the marginal table", map.height);
    s.build_marginal(weights, sines, built.marginal);

    const std::size_t row_entries = (std::size_t{1} << built.row_bits) + 1;
    built.marginal_guide = Uints(s.device, "the marginal's guide", row_entries);
    s.build_guides(s.device.thin(row_entries), built.marginal, narrow(map.height), 1U, built.row_bits,
                   built.marginal_guide);

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
    s.build_guides(s.device.thin(d.conditional_guide.size()), d.conditional, narrow(d.width), narrow(d.height),
                   d.column_bits, d.conditional_guide);
    s.build_guides(s.device.thin(d.marginal_guide.size()), d.marginal, narrow(d.height), 1U, d.row_bits,
                   d.marginal_guide);
    s.device.finish();
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
