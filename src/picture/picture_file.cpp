#include "picture/picture_file.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/text_escape.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

void add_values(Header& header, const std::string& prefix, const nlohmann::json& values) {
    for (const auto& [key, value] : values.items()) {
        HeaderValue entry;
        if (value.is_number()) {
            entry.is_number = true;
            entry.number = value.get<double>();
        } else if (value.is_string()) {
            entry.text = value.get<std::string>();
        } else if (value.is_boolean()) {
            entry.text = value.get<bool>() ? "true" : "false";
        } else if (value.is_object()) {
            add_values(header, prefix + key + ":", value);
            continue;
        } else if (value.is_array() &&
                   std::all_of(value.begin(), value.end(), [](const auto& v) { return v.is_string(); })) {
            entry.text = fmt::format("{}", fmt::join(value.get<std::vector<std::string>>(), ","));
        } else {
            continue;
        }
        header[prefix + key] = entry;
    }
}

}  // namespace

void check_picture_suffix(const std::string& file) {
    const std::string suffix = suffix_of(file);
    if (suffix != ".exr" && suffix != ".png") {
        throw UsageError(fmt::format("{}: a picture ends in .exr or .png", file));
    }
}

bool is_preview(const std::string& file) { return suffix_of(file) == ".png"; }

std::vector<cl_uint> preview_of(const Rendered& picture, const ToneOptions& tone, Display& display) {
    return display.preview(picture.rgba, 4, tone);
}

void write_picture(const std::string& file, const Rendered& picture, std::span<const cl_uint> preview,
                   const Header& header, const PngText& text) {
    check_picture_suffix(file);
    if (is_preview(file)) {
        write_png(file, picture.size, picture.size, 4, reinterpret_cast<const unsigned char*>(preview.data()), text);
    } else {
        write_exr(file, picture.size, picture.size, picture.rgba.data(), header);
    }
}

void write_picture(const std::string& file, const Rendered& picture, const ToneOptions& tone, Display& display,
                   const Header& header) {
    std::vector<cl_uint> preview;
    if (is_preview(file)) preview = preview_of(picture, tone, display);
    write_picture(file, picture, preview, header, {});
}

Header flat_header(const nlohmann::json& parameters, const nlohmann::json& seconds) {
    Header header;
    add_values(header, "clerestory:", parameters);
    add_values(header, "clerestory:seconds:", seconds);
    return header;
}

}  // namespace clerestory
