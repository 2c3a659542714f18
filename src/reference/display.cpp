#include "reference/display.hpp"

#include <cmath>

namespace clerestory::reference {

long double tone(long double radiance, long double exposure, long double gamma) {
    const long double exposed = exposure * radiance;
    if (!(exposed > 0)) return 0;
    return exposed >= 1 ? 255 : 255 * std::exp(std::log(exposed) / gamma);
}

std::vector<std::uint8_t> marked(std::span<const std::uint32_t> texels, std::size_t width, std::size_t height) {
    std::vector<std::uint8_t> covered(width * height, 0);
    for (std::size_t at = 0; at < covered.size(); ++at) {
        const auto row = static_cast<std::int64_t>(at / width);
        const auto column = static_cast<std::int64_t>(at % width);
        for (const std::uint32_t texel : texels) {
            const std::int64_t rows = std::abs(row - static_cast<std::int64_t>(texel / width));
            const std::int64_t columns = std::abs(column - static_cast<std::int64_t>(texel % width));
            if (rows <= 2 && columns <= 2) covered[at] = 1;
        }
    }
    return covered;
}

}  // namespace clerestory::reference
