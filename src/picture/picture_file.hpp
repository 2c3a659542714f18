#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "image.hpp"
#include "map/png_text.hpp"
#include "render/renderer.hpp"
#include "shading/display.hpp"

namespace clerestory {

/// Throws UsageError unless the name ends in .exr or .png.
void check_picture_suffix(const std::string& file);

/// Writes a picture by its suffix: .exr as float RGBA with `header`, .png as an 8-bit preview. Whole or not at all.
/// Throws OutputError, UsageError for another suffix.
void write_picture(const std::string& file, const Rendered& picture, const ToneOptions& tone, Display& display,
                   const Header& header);

/// The 8-bit preview of a picture: [size * size], four bytes each, R lowest.
std::vector<cl_uint> preview_of(const Rendered& picture, const ToneOptions& tone, Display& display);

/// The same with the preview made already and, in a PNG, `text` beside it: needs no device, so it can run in any
/// thread.
void write_picture(const std::string& file, const Rendered& picture, std::span<const cl_uint> preview,
                   const Header& header, const PngText& text);

/// Whether a file that write_picture would name is a PNG, which needs a preview.
bool is_preview(const std::string& file);

/// A report as header attributes: each key under "clerestory:", stages' seconds under "clerestory:seconds:".
Header flat_header(const nlohmann::json& parameters, const nlohmann::json& seconds);

}  // namespace clerestory
