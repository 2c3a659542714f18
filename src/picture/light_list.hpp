#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "sampling/sample_records.hpp"

namespace clerestory {

/// A directional light that stands for one sample.
struct DirectionalLight {
    float direction[3] = {};  ///< unit, world space, towards the light
    double weight[3] = {};    ///< R, G, B
};

/// Samples as lights for other renderers: the sum over lights of weight * max(0, n . direction) * albedo / pi is the
/// plain estimate of the radiance of a diffuse surface with normal n, so weight = scale * radiance / (N density).
///   scale  multiplies the environment
std::vector<DirectionalLight> light_list(const std::vector<SampleRecord>& records, double scale);

/// `{"format": "clerestory-lights", "version": 1, <facts>, "lights": [{"direction": [x, y, z], "weight": [r, g, b]}]}`,
/// a line a light; every number reads back to the same value.
///   facts  an object: where the lights come from
std::string lights_json(const std::vector<DirectionalLight>& lights, const nlohmann::json& facts);

/// Writes an image with a pixel a light, row by row in rows of at most 4096: channels direction.X, direction.Y,
/// direction.Z and R, G, B (the weight), 32-bit floats. What the last row has to spare has weight 0. The header holds
/// the number of lights and `facts`. Whole or not at all.
/// Throws OutputError, also for a weight that leaves float32.
void write_lights_exr(const std::filesystem::path& file, const std::vector<DirectionalLight>& lights,
                      const nlohmann::json& facts);

}  // namespace clerestory
