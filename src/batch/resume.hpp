#pragma once

#include <string>

#include "render/picture_recipe.hpp"

namespace clerestory {

/// The header attribute, and the PNG text key, that hold a picture's digest.
inline constexpr const char* DIGEST_KEY = "clerestory:digest";

/// What decides the bytes of an output: the map's content, every parameter that its estimator reads, and the code that
/// made it (kernels and host, not its version, which may stand still while they change). The device is left out: a
/// batch may go on elsewhere.
///   map_digest  digest_of_file of the map
///   preview     whether the output is an 8-bit one, which exposure and gamma decide too
std::string picture_digest(const PictureRecipe& recipe, const std::string& map_digest, bool preview);

/// Whether `file` is a whole picture that carries `digest`. Never throws: what cannot be read is not current.
bool is_current(const std::string& file, const std::string& digest) noexcept;

}  // namespace clerestory
