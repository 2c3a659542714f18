#include "render/picture_recipe.hpp"

#include <nlohmann/json.hpp>

namespace clerestory {

nlohmann::json describe_picture(const MapOptions& map, const RenderOptions& options, const RadianceMap& read,
                                const Device& device) {
    nlohmann::json values = describe_map(map, read);
    values["estimator"] = estimator_name(options.estimator);
    values["samples"] = options.samples;
    values["sequence"] = sequence_name(options.sampling.sequence);
    values["texel"] = texel_place_name(options.sampling.place);
    values["seed"] = options.sampling.seed;
    values["control_degree"] = options.sampling.control_degree;
    if (options.estimator == Estimator::harmonic) {
        values["degree"] = options.harmonic.degree;
        values["lights"] = options.harmonic.lights;
    }
    values["size"] = options.size;
    values["albedo"] = options.albedo;
    values["device"] = device.info().name;
    values["platform"] = device.info().version;
    values["version"] = CLERESTORY_VERSION;
    return values;
}

}  // namespace clerestory
