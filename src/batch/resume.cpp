#include "batch/resume.hpp"

#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/digest.hpp"
#include "base/json_text.hpp"
#include "image.hpp"
#include "map/image_source.hpp"
#include "map/png_text.hpp"
#include "picture/picture_file.hpp"
#include "render/method.hpp"
#include "render/source_digest.hpp"

namespace clerestory {

namespace {

/// Throws InputError where the last row of an EXR file cannot be read; rows stand in order, so with it all can.
void check_last_row(const std::string& file) {
    const auto source = open_exr(file, {});
    const std::size_t begin = (source->height() - 1) / source->chunk_rows() * source->chunk_rows();
    std::vector<float> row(3 * source->width());
    source->read_rows(begin, source->height(), {row.data(), 0}, {});
}

}  // namespace

std::string picture_digest(const PictureRecipe& recipe, const std::string& map_digest, bool preview) {
    const MapOptions& map = recipe.map;
    const RenderOptions& render = recipe.render;
    nlohmann::json all = {
        {"sources", source_digest()}, {"map", map_digest},      {"reading", describe_reading(map)},
        {"rotate_y", map.rotate_y},   {"scale", map.scale},     {"estimator", estimator_name(render.estimator)},
        {"size", render.size},        {"albedo", render.albedo}};
    if (draws_samples(render.estimator)) {
        all["samples"] = render.samples;
        all["sequence"] = sequence_name(render.sampling.sequence);
        all["texel"] = texel_place_name(render.sampling.place);
        all["seed"] = render.sampling.seed;
        all["control_degree"] = render.sampling.control_degree;
    }
    if (render.estimator == Estimator::harmonic) {
        all["degree"] = render.harmonic.degree;
        all["lights"] = render.harmonic.lights;
    }
    if (preview) {
        all["exposure"] = recipe.tone.exposure;
        all["gamma"] = recipe.tone.gamma;
    }
    return digest_of(json_text(all, -1));
}

bool is_current(const std::string& file, const std::string& digest) noexcept {
    try {
        std::error_code error;
        if (!std::filesystem::is_regular_file(file, error)) return false;
        if (is_preview(file)) {
            const PngText text = read_png_text(file);
            const auto found = text.find(DIGEST_KEY);
            return found != text.end() && found->second == digest;
        }
        check_last_row(file);
        const Header header = read_exr_header(file);
        const auto found = header.find(DIGEST_KEY);
        return found != header.end() && found->second.text == digest;
    } catch (const std::exception&) {
        return false;
    }
}

}  // namespace clerestory
