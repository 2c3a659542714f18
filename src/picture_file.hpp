#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "image.hpp"
#include "render.hpp"
#include "sphere.hpp"

namespace clerestory {

/// Throws UsageError unless the name ends in .exr or .png.
void check_picture_suffix(const std::string& file);

/// Writes a picture by its suffix: .exr as float RGBA with `header`, .png as an 8-bit preview. Whole or not at all.
/// Throws OutputError, UsageError for another suffix.
void write_picture(const std::string& file, const Rendered& picture, const ToneOptions& tone, Display& display,
                   const Header& header);

/// A report as header attributes: each key under "clerestory:", stages' seconds under "clerestory:seconds:".
Header flat_header(const nlohmann::json& parameters, const nlohmann::json& seconds);

}  // namespace clerestory
