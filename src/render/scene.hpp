#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>

#include "cl/device.hpp"
#include "image.hpp"
#include "options.hpp"
#include "tables/stage2_cdf.hpp"
#include "tables/table_arithmetic.hpp"

namespace clerestory {

struct SceneOptions {
    TableOptions tables;
    BadTexels bad_texels = BadTexels::refuse;
    TableArithmetic arithmetic = TableArithmetic::integer;  ///< others are there to see what they lose
};

/// A scene's tables, begun while its map was being read.
struct BegunTables {
    DeviceMap map;
    UnfinishedTables tables;
    double seconds = 0;  ///< spent on them so far
};

/// A map with its sampling distribution: what every estimator lights the sphere with.
class Scene {
  public:
    /// Throws InputError for bad texels that are not to be repaired.
    ///   begun  tables that hold every row of the map already; see SceneLoader
    Scene(const Device& device, TableBuilder& builder, RadianceMap map, const SceneOptions& options = {},
          std::optional<BegunTables> begun = {});
    Scene(const Scene&) = delete;  // the device reads the map where it lies
    Scene& operator=(const Scene&) = delete;

    [[nodiscard]] const RadianceMap& map() const noexcept { return map_; }
    [[nodiscard]] const DeviceMap& device_map() const noexcept { return device_map_; }
    [[nodiscard]] const Distribution& distribution() const noexcept { return distribution_; }
    /// Texels that were blackened because they were NaN, infinite or negative.
    [[nodiscard]] std::size_t repaired() const noexcept { return repaired_; }
    /// The same for one scene as long as it lives, and never that of another: what is kept of a scene is kept by it.
    [[nodiscard]] std::weak_ptr<const void> identity() const noexcept { return identity_; }
    /// Seconds that the tables took, beside the decoder where they were built while the map was being read.
    [[nodiscard]] double build_seconds() const noexcept { return build_seconds_; }

  private:
    std::shared_ptr<const void> identity_ = std::make_shared<char>();
    RadianceMap map_;
    std::size_t repaired_ = 0;
    double build_seconds_ = 0;
    DeviceMap device_map_;
    Distribution distribution_;
};

}  // namespace clerestory
