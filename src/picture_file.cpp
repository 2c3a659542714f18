#include "picture_file.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

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
        } else {
            continue;
        }
        header[prefix + key] = entry;
    }
}

}  // namespace

void check_picture_suffix(const std::string& file) {
    const auto suffix = std::filesystem::path(file).extension();
    if (suffix != ".exr" && suffix != ".png") {
        throw UsageError(fmt::format("{}: a picture ends in .exr or .png", file));
    }
}

void write_picture(const std::string& file, const Rendered& picture, const ToneOptions& tone, Display& display,
                   const Header& header) {
    check_picture_suffix(file);
    if (std::filesystem::path(file).extension() == ".exr") {
        write_exr(file, picture.size, picture.size, picture.rgba.data(), header);
        return;
    }
    const auto preview = display.preview(picture.rgba, 4, tone);
    write_png(file, picture.size, picture.size, 4, reinterpret_cast<const unsigned char*>(preview.data()));
}

Header flat_header(const nlohmann::json& parameters, const nlohmann::json& seconds) {
    Header header;
    add_values(header, "clerestory:", parameters);
    add_values(header, "clerestory:seconds:", seconds);
    return header;
}

}  // namespace clerestory
