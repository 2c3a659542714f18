#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace clerestory {

/// Renderers whose scene files can be written.
enum class SceneFormat {
    pbrt,     ///< pbrt-v4, .pbrt; the map as an equal-area image, which its imgtool makes
    mitsuba,  ///< Mitsuba 3, .xml
};

/// Every format's name at the command line, and a format by its name. Throws UsageError.
std::vector<std::string> scene_format_names();
SceneFormat scene_format_by_name(const std::string& name);
/// Suffix of the format's files, with its dot.
std::string scene_suffix(SceneFormat format);

/// What is rendered: the white sphere of `render`, its map and its view.
struct ExportedScene {
    std::filesystem::path map;  ///< as the scene is to name it
    bool flip_y = false;
    double rotate_y_deg = 0;
    double scale = 1;
    double albedo = 1;
    std::size_t size = 511;    ///< pixels of a side
    std::size_t samples = 64;  ///< a pixel
    std::string stem;          ///< of the files that the renderer's own tools are to write
};

/// The rotation or reflection, row by row, from the renderer's own frame of an environment map to the world, such that
/// a texel lights from where this program has it. Source: see scene_export.cpp.
std::array<double, 9> map_to_world(SceneFormat format, bool flip_y, double rotate_y_deg);

/// The scene file's text, with a comment that says how to render it.
std::string scene_text(SceneFormat format, const ExportedScene& scene);

}  // namespace clerestory
