#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>

#include "map/image_source.hpp"

namespace clerestory {

/// A rectangle of texels in the coordinates that a file's windows share.
struct Window {
    std::int64_t x = 0;
    std::int64_t y = 0;
    std::size_t width = 0;
    std::size_t height = 0;
    bool operator==(const Window&) const = default;
};

/// `source`, which holds the texels of the window `data`, as a picture of the window `display`: black, with alpha 0,
/// where it has no texel, and without those that lie outside. The source itself where the windows are one. Throws
/// InputError where they have no texel in common, and for a `display` beyond the limits.
std::unique_ptr<ImageSource> placed(const std::filesystem::path& file, std::unique_ptr<ImageSource> source,
                                    const Window& data, const Window& display, const ReadLimits& limits);

}  // namespace clerestory
