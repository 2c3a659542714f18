#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace clerestory {

/// What an EXR file's header says of one part.
struct ExrPart {
    std::string name;                   ///< "" where it has none
    bool flat = true;                   ///< an image; false: deep samples
    std::vector<std::string> channels;  ///< as the file orders them, that is by alphabet
};

/// Which part and layer the user asked for.
struct LayerRequest {
    std::string layer;        ///< "" for the one that lights by itself
    std::optional<int> part;  ///< from 0
};

/// How a layer's channels make a colour.
enum class LayerKind { rgb, luminance, luminance_chroma };

/// What lights.
struct ChosenLayer {
    int part = 0;
    std::string layer;  ///< its channels' names up to the last dot; "" for the unnamed layer
    LayerKind kind = LayerKind::rgb;
    std::array<std::string, 3> channels;   ///< red, green, blue; Y, RY, BY; the luminance thrice
    std::string alpha;                     ///< "" where there is none
    std::vector<std::string> passed_over;  ///< layers that could have lit as well, where only their order decided
};

/// Chooses what lights of the parts of `file`, whose name begins messages.
///
/// The unnamed layer with red, green and blue (R, G, B or Red, Green, Blue, in any case) lights; where several parts
/// have one, the part whose name ends in Combined, rgba, beauty or Ci, else the first. Without one, the only layer with
/// red, green and blue does, or the only one of those four names. Without any, luminance and chroma do (Y, RY, BY),
/// else a lone luminance. Depth, normals, mattes, thumbnails and alpha never light unless they are asked for by name.
///
/// Throws InputError naming the layers where several could light and none of them is meant for it, where none can, and
/// where the request names none.
ChosenLayer choose_layer(const std::filesystem::path& file, std::span<const ExrPart> parts,
                         const LayerRequest& request);

}  // namespace clerestory
