#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "reference/draw.hpp"
#include "sampling/stage3_sample.hpp"
#include "tables/stage2_cdf.hpp"

namespace clerestory::test {

/// A map with its distribution and all that draws from it.
struct LitMap {
    LitMap(const Device& device, RadianceMap&& made, const SamplingOptions& options = {},
           Search search = Search::guided)
        : map(std::move(made)),
          on_device(device, map),
          distribution(TableBuilder(device).build(on_device)),
          sampler(device, on_device, distribution, options, search),
          marginal(distribution.marginal.download()),
          conditional(distribution.conditional.download()) {}
    LitMap(const LitMap&) = delete;
    LitMap& operator=(const LitMap&) = delete;

    [[nodiscard]] reference::TablesView tables() const { return {map.width, map.height, marginal, conditional}; }
    [[nodiscard]] bool is_lit(std::size_t texel) const {
        return map.rgb[3 * texel] > 0 || map.rgb[3 * texel + 1] > 0 || map.rgb[3 * texel + 2] > 0;
    }

    RadianceMap map;
    DeviceMap on_device;
    Distribution distribution;
    Sampler sampler;
    std::vector<cl_uint> marginal;
    std::vector<cl_uint> conditional;
};

}  // namespace clerestory::test
