#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "cl/buffer.hpp"
#include "cl/device.hpp"
#include "image.hpp"
#include "map/texel_counts.hpp"
#include "options.hpp"
#include "shared_types.h"

namespace clerestory {

/// How rows are shared out among work-items; the tables are the same to the bit.
enum class ScanPath {
    automatic,  ///< whole rows where there are enough to fill the device, else chunks
    rows,       ///< one work-item per row; chunks where a row does not fit into the device's local memory
    chunks,     ///< one work-item per chunk of CHUNK_TEXELS texels, several launches
};

struct TableOptions {
    Luminance luminance = Luminance::average;
    ScanPath path = ScanPath::automatic;
};

/// A map's radiance where the kernels can read it. The map must outlive it: a CPU device reads it where it lies.
struct DeviceMap {
    DeviceMap(const Device& device, const RadianceMap& map);

    std::size_t width = 0;
    std::size_t height = 0;
    Buffer<cl_float> radiance;  ///< [3 * height * width]
};

/// A map's sampling distribution: integer cumulative tables on the device, and what the host knows of them.
struct Distribution {
    std::size_t width = 0;
    std::size_t height = 0;
    unsigned row_bits = 0;              ///< the marginal's guide has 2^row_bits + 1 entries
    unsigned column_bits = 0;           ///< each row's guide has 2^column_bits + 1 entries
    Buffer<cl_uint> marginal;           ///< [height], ends in units of 2^-TABLE_BITS
    Buffer<cl_uint> marginal_guide;     ///< [2^row_bits + 1]
    Buffer<cl_uint> conditional;        ///< [height * width], ends in units of 2^-TABLE_BITS
    Buffer<cl_uint> conditional_guide;  ///< [height * (2^column_bits + 1)]
    Buffer<RowFrame> frames;            ///< [height]
    MapCounts counts;
    int exponent = 0;  ///< the map times 2^-exponent is at most 4; kernels work in that scale
    double phi = 0;    ///< integral of intensity over the sphere
    /// Nothing to draw from: no texel is lit.
    [[nodiscard]] bool black() const noexcept { return phi == 0; }
};

/// Probability of every texel, in double, from the integer tables.
///   returns [height * width]
std::vector<double> texel_probabilities(const Distribution& distribution);

/// A distribution of which only some rows are built yet.
struct UnfinishedTables {
    TableOptions options;
    Distribution built;
    Buffer<TexelCounts> counts;  ///< [height]
    Buffer<RowWeight> weights;   ///< [height]
};

/// Builds distributions; the kernels are compiled once, when it is made.
class TableBuilder {
  public:
    explicit TableBuilder(const Device& device);
    TableBuilder(TableBuilder&&) noexcept;
    TableBuilder& operator=(TableBuilder&&) noexcept;
    ~TableBuilder();

    /// Throws InputError where the map has a bad texel: check `counts` by reading, or repair the map before.
    ///   spare  a distribution that is no longer needed: arrays of the right size are used again, which saves first
    ///          touching new ones
    Distribution build(const DeviceMap& map, const TableOptions& options = {}, Distribution spare = {});

    /// The same for a map whose rows become final one after the other: `start`, `add_rows` once for every row, in any
    /// order, and `finish`, which throws as `build` does. add_rows has read the rows when it returns, and reads no
    /// others. A map that has to be cut into chunks is built when it is finished.
    UnfinishedTables start(std::size_t width, std::size_t height, const TableOptions& options = {},
                           Distribution spare = {});
    void add_rows(UnfinishedTables& tables, const DeviceMap& map, std::size_t begin, std::size_t end);
    Distribution finish(UnfinishedTables tables, const DeviceMap& map);

    /// Guides anew for tables that were changed.
    void build_guides(Distribution& distribution);

    /// Counts bad texels and the brightest component, without building anything.
    MapCounts count_texels(const DeviceMap& map);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace clerestory
