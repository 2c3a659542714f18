#include "scene.hpp"

#include <utility>

#include "clock.hpp"

namespace clerestory {

Scene::Scene(const Device& device, TableBuilder& builder, RadianceMap map, const SceneOptions& options)
    : map_(std::move(map)),
      repaired_(options.bad_texels == BadTexels::zero ? zero_bad_texels(map_) : 0),
      device_map_(device, map_) {
    const Stopwatch building;
    distribution_ = builder.build(device_map_, options.tables);
    use_arithmetic(device, builder, device_map_, options.tables.luminance, options.arithmetic, distribution_);
    build_seconds_ = building.seconds();
}

}  // namespace clerestory
