#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "clerestory/device.hpp"
#include "clerestory/export.hpp"
#include "clerestory/image.hpp"
#include "clerestory/options.hpp"

namespace clerestory {

/// A map with its sampling tables, on the device of the engine that made it, which it keeps open. Cheap to copy: copies
/// share the map.
class CLERESTORY_API EnvironmentMap {
  public:
    [[nodiscard]] const RadianceMap& map() const noexcept;
    /// Integral of intensity over the sphere.
    [[nodiscard]] double phi() const noexcept;
    /// No texel is lit: pictures are black, and there is nothing to draw from.
    [[nodiscard]] bool black() const noexcept;
    /// Texels that were blackened because they were NaN, infinite or negative.
    [[nodiscard]] std::size_t repaired() const noexcept;
    /// Seconds that the tables took.
    [[nodiscard]] double build_seconds() const noexcept;

    struct State;
    explicit EnvironmentMap(std::shared_ptr<const State> state) : state_(std::move(state)) {}
    [[nodiscard]] const State& state() const noexcept { return *state_; }

  private:
    std::shared_ptr<const State> state_;
};

/// One sample with its density in double, straight from the integer tables.
struct SampleRecord {
    std::size_t row = 0;
    std::size_t column = 0;
    double theta = 0;  ///< radians from +y
    double phi = 0;    ///< radians, the rotation applied, in [0, 2 pi)
    float direction[3] = {};
    double pdf = 0;  ///< per steradian
    float rgb[3] = {};
};

/// Samples drawn from an environment, on its device.
class CLERESTORY_API Samples {
  public:
    [[nodiscard]] std::size_t count() const noexcept;
    /// Reads them back. sum(rgb max(0, n . direction) / pdf) / count estimates the irradiance at a normal n.
    [[nodiscard]] std::vector<SampleRecord> records() const;

    struct State;
    explicit Samples(std::shared_ptr<const State> state) : state_(std::move(state)) {}
    [[nodiscard]] const State& state() const noexcept { return *state_; }

  private:
    std::shared_ptr<const State> state_;
};

/// Seconds by stage, in the order of work.
using StageSeconds = std::vector<std::pair<std::string, double>>;

/// A picture of the sphere.
struct Rendered {
    std::size_t size = 0;     ///< pixels of a side
    std::vector<float> rgba;  ///< [4 * size * size], linear, top row first, alpha 0 beside the sphere
    StageSeconds seconds;
};

/// A way to light the sphere that reaches an asked error, and what it was chosen over.
struct TargetChoice {
    RenderOptions method;      ///< what was asked for, with the chosen estimator, samples, degrees and lights
    double reached_error = 0;  ///< relative RMSE of this very picture, measured on a small one
    std::string choice;        ///< as flags of `render`
    std::string why;           ///< a sentence
};

/// An open OpenCL device with the program's kernels, built when first needed and kept. One thread at a time may use an
/// engine and what it made; several engines may stand side by side. Every function throws DeviceError where the device
/// fails or has too little memory, and UsageError for options out of their ranges, maps and pictures whose arrays do
/// not fit their sizes, and environments of another engine.
class CLERESTORY_API Engine {
  public:
    /// Opens a device. Throws DeviceError where there is none, UsageError for a bad selector.
    explicit Engine(const DeviceOptions& options = {});

    [[nodiscard]] const DeviceInfo& device() const noexcept;

    /// Takes a map and builds its sampling tables. Throws InputError for bad texels that are not to be blackened.
    EnvironmentMap environment(RadianceMap map, const EnvironmentOptions& options = {});

    /// Draws `count` samples, 1 .. 2^30. The same options draw the same bits. Throws InputError where the map is black.
    Samples draw(const EnvironmentMap& environment, std::size_t count, const SamplingOptions& options = {});

    /// LightBuffer the sphere. A black map gives a black sphere.
    Rendered render(const EnvironmentMap& environment, const RenderOptions& options = {},
                    const ProgressFunction& progress = {});

    /// Picks the fastest way to light the sphere whose relative RMSE is at most `target_error` on this map.
    ///   asked  size, rotation, place in the texel and seed are taken from it
    /// Throws UsageError where the target is not positive.
    TargetChoice choose(const EnvironmentMap& environment, const RenderOptions& asked, double target_error);

    /// 8-bit preview of a picture.
    ///   returns [4 * size * size]  R, G, B, A
    std::vector<unsigned char> preview(const Rendered& picture, const ToneOptions& tone = {});

    /// 8-bit preview of the map, times `scale`, each sample's texel marked by a 5x5 green square clipped at the edges.
    ///   returns [4 * width * height]  R, G, B, A
    std::vector<unsigned char> marked_map(const EnvironmentMap& environment, const Samples& samples, double scale = 1,
                                          const ToneOptions& tone = {});

    /// Writes a picture by its suffix: .exr as float RGBA with `header`, .png as an 8-bit preview; whole or not at all.
    /// Throws OutputError, UsageError for another suffix.
    void write(const std::filesystem::path& file, const Rendered& picture, const ToneOptions& tone = {},
               const Header& header = {});

    struct State;
    [[nodiscard]] State& state() noexcept { return *state_; }

  private:
    void check_own(const EnvironmentMap& environment) const;

    std::shared_ptr<State> state_;
};

}  // namespace clerestory
