#include "render/scene.hpp"

#include <utility>

#include "base/clock.hpp"
#include "map/texel_counts.hpp"

namespace clerestory {

Scene::Scene(const Device& device, TableBuilder& builder, RadianceMap map, const SceneOptions& options,
             std::optional<BegunTables> begun)
    : map_(std::move(map)),
      repaired_(options.bad_texels == BadTexels::zero ? zero_bad_texels(map_) : 0),
      device_map_(begun ? std::move(begun->map) : DeviceMap(device, map_)) {
    const Stopwatch building;
    distribution_ =
        begun ? builder.finish(std::move(begun->tables), device_map_) : builder.build(device_map_, options.tables);
    use_arithmetic(device, builder, device_map_, options.tables.luminance, options.arithmetic, distribution_);
    build_seconds_ = building.seconds() + (begun ? begun->seconds : 0);
}

}  // namespace clerestory
