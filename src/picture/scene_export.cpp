#include "picture/scene_export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include "base/named_values.hpp"
#include "base/text_escape.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

const NamedValues<SceneFormat>& formats() {
    static const NamedValues<SceneFormat> all("scene format",
                                              {{SceneFormat::pbrt, "pbrt"}, {SceneFormat::mitsuba, "mitsuba"}});
    return all;
}

/// pbrt's strings: quotes, backslashes and the controls that have a letter are escaped; all else stands for itself.
std::string pbrt_string(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        constexpr std::string_view CONTROLS = "\b\f\n\r\t";
        constexpr std::string_view LETTERS = "bfnrt";
        const std::size_t control = CONTROLS.find(c);
        if (c == '"' || c == '\\' || control != std::string_view::npos) out += '\\';
        out += control != std::string_view::npos ? LETTERS[control] : c;
    }
    return out + '"';
}

/// A file's name as an attribute of XML, which would read line ends and tabs as blanks and has no other controls at
/// all.
std::string xml_attribute(const std::filesystem::path& file) {
    std::string out;
    for (const char c : escaped(file.string())) {
        const bool is_blank = c == '\n' || c == '\r' || c == '\t';
        out += is_blank ? fmt::format("&#{};", static_cast<int>(c)) : std::string(1, c);
    }
    if (one_line(out) == out) return out;
    throw OutputError(
        fmt::format("{}: has control characters or bytes that are no UTF-8 in its name, which a scene of Mitsuba "
                    "cannot hold; give the map another name",
                    file.string()));
}

/// The 4 x 4 matrix of a 3 x 3 one, row by row or column by column.
std::string numbers_of(const std::array<double, 9>& m, bool by_rows) {
    std::array<double, 16> all{};
    all[15] = 1;
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) all[by_rows ? 4 * i + j : 4 * j + i] = m[3 * i + j];
    }
    return fmt::format("{}", fmt::join(all, " "));
}

/// Both renderers hold a reflectance to 1; light and albedo only ever appear as their product.
ExportedScene within_reflectance(ExportedScene scene) {
    const double excess = std::max(scene.albedo, 1.0);
    scene.albedo /= excess;
    scene.scale *= excess;
    return scene;
}

std::string pbrt_text(const ExportedScene& scene) {
    const std::string map = scene.stem + "_equiarea.exr";
    return fmt::format(
        R"(# A diffuse sphere lit by a map, for pbrt-v4. First, once, the map as pbrt wants it:
#   imgtool makeequiarea --outfile {map_word} {source_word}
Option "disablepixeljitter" true
Film "rgb" "string filename" {picture_string} "integer xresolution" {size} "integer yresolution" {size} "bool savefp16" false
PixelFilter "box"
Sampler "zsobol" "integer pixelsamples" {samples}
Integrator "path" "integer maxdepth" 1
# pbrt's camera is left-handed; the world here is right-handed.
Scale -1 1 1
LookAt 0 0 2  0 0 0  0 1 0
Camera "orthographic" "float screenwindow" [ -1 1 -1 1 ]
WorldBegin
AttributeBegin
  # from the map's own frame (+z up) to the world (+y up), column by column
  Transform [ {matrix} ]
  LightSource "infinite" "string filename" {map_string} "float scale" {scale}
AttributeEnd
Material "diffuse" "rgb reflectance" [ {albedo} {albedo} {albedo} ]
Shape "sphere" "float radius" 1
)",
        fmt::arg("map_word", shell_path(map)), fmt::arg("source_word", shell_path(scene.map)),
        fmt::arg("map_string", pbrt_string(map)), fmt::arg("picture_string", pbrt_string(scene.stem + "_pbrt.exr")),
        fmt::arg("size", scene.size), fmt::arg("samples", scene.samples),
        fmt::arg("matrix", numbers_of(map_to_world(SceneFormat::pbrt, scene.flip_y, scene.rotate_y_deg), false)),
        fmt::arg("scale", scene.scale), fmt::arg("albedo", scene.albedo));
}

std::string mitsuba_text(const ExportedScene& scene) {
    return fmt::format(
        R"(<?xml version="1.0" encoding="utf-8"?>
<!-- A diffuse sphere lit by a map, for Mitsuba 3. Its program writes
     the picture beside this file, under the same name, unless it is given another with -o. -->
<scene version="3.0.0">
    <integrator type="direct">
        <boolean name="hide_emitters" value="true"/>
    </integrator>
    <sensor type="orthographic">
        <float name="near_clip" value="0.5"/>
        <float name="far_clip" value="4"/>
        <transform name="to_world">
            <lookat origin="0, 0, 2" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <sampler type="multijitter">
            <integer name="sample_count" value="{samples}"/>
        </sampler>
        <film type="hdrfilm">
            <integer name="width" value="{size}"/>
            <integer name="height" value="{size}"/>
            <string name="pixel_format" value="rgba"/>
            <string name="component_format" value="float32"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    <emitter type="envmap">
        <string name="filename" value="{map}"/>
        <float name="scale" value="{scale}"/>
        <transform name="to_world">
            <!-- row by row -->
            <matrix value="{matrix}"/>
        </transform>
    </emitter>
    <shape type="sphere">
        <bsdf type="diffuse">
            <rgb name="reflectance" value="{albedo}"/>
        </bsdf>
    </shape>
</scene>
)",
        fmt::arg("samples", scene.samples), fmt::arg("size", scene.size), fmt::arg("map", xml_attribute(scene.map)),
        fmt::arg("scale", scene.scale),
        fmt::arg("matrix", numbers_of(map_to_world(SceneFormat::mitsuba, scene.flip_y, scene.rotate_y_deg), true)),
        fmt::arg("albedo", scene.albedo));
}

}  // namespace

std::vector<std::string> scene_format_names() { return formats().names(); }
SceneFormat scene_format_by_name(const std::string& name) { return formats().by_name(name); }
std::string scene_suffix(SceneFormat format) { return format == SceneFormat::pbrt ? ".pbrt" : ".xml"; }

// Where a column at the fraction u of the map's width lies, a = 2 pi u, s and c the sine and cosine of theta:
//   here      world (s cos(a + r), c, s sin(a + r)), r the rotation; -c with flip_y
//   pbrt-v4   local (s cos a, s sin a, c): imgtool's makeequiarea and SphericalPhi, SphericalTheta of util/vecmath.h
//   Mitsuba   local (s sin a, c, -s cos a): src/emitters/envmap.cpp
std::array<double, 9> map_to_world(SceneFormat format, bool flip_y, double rotate_y_deg) {
    constexpr double FULL_TURN_DEG = 360;
    const double r = std::remainder(rotate_y_deg, FULL_TURN_DEG) / FULL_TURN_DEG * 2 * std::numbers::pi;
    const double up = flip_y ? -1 : 1;
    // What a whole number of quarter turns leaves of 0 is rounding.
    const auto tidy = [](double value) { return std::abs(value) < 1e-15 ? 0 : value; };
    const double sine = tidy(std::sin(r));
    const double cosine = tidy(std::cos(r));
    if (format == SceneFormat::pbrt) return {cosine, 0 - sine, 0, 0, 0, up, sine, cosine, 0};
    return {0 - sine, 0, 0 - cosine, 0, up, 0, cosine, 0, 0 - sine};
}

std::string scene_text(SceneFormat format, const ExportedScene& scene) {
    const ExportedScene held = within_reflectance(scene);
    return format == SceneFormat::pbrt ? pbrt_text(held) : mitsuba_text(held);
}

}  // namespace clerestory
