#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "map/oiio_abi.hpp"

/// The only file that includes OpenImageIO: a module of its own, because merely loading that library takes about 0.2 s.
namespace clerestory::oiio_abi {

struct Image {
    std::unique_ptr<OIIO::ImageInput> input;
    std::array<int, 4> channels{};  ///< red, green, blue, alpha; alpha -1 where there is none
    std::vector<float> row_block;   ///< all the file's channels of the rows being read
};

namespace {

void say(char* message, const std::string& text) {
    std::snprintf(message, MESSAGE_SIZE, "%s", text.substr(0, text.find('\n')).c_str());
}

/// The channel called `name` or by its initial, in any case; else -1.
int find_channel(const OIIO::ImageSpec& spec, const std::string& name) {
    for (int c = 0; c < spec.nchannels; ++c) {
        std::string candidate = spec.channel_name(c);
        std::transform(candidate.begin(), candidate.end(), candidate.begin(),
                       [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
        if (candidate == name || candidate == name.substr(0, 1)) return c;
    }
    return -1;
}

/// R, G and B by name, else the first three channels that are not alpha, else the first alone three times.
std::array<int, 4> choose_channels(const OIIO::ImageSpec& spec) {
    const int alpha = spec.nchannels > 1 ? spec.alpha_channel : -1;
    const int red = find_channel(spec, "red");
    const int green = find_channel(spec, "green");
    const int blue = find_channel(spec, "blue");
    if (red >= 0 && green >= 0 && blue >= 0) return {red, green, blue, alpha};
    std::vector<int> colour;
    for (int c = 0; c < spec.nchannels; ++c) {
        if (c != alpha) colour.push_back(c);
    }
    if (colour.size() < 3) return {colour[0], colour[0], colour[0], alpha};
    return {colour[0], colour[1], colour[2], alpha};
}

Info describe(const OIIO::ImageSpec& spec, const Image& image) {
    Info info{};
    info.width = spec.width;
    info.height = spec.height;
    info.chunk_rows = spec.tile_height > 0 ? spec.tile_height : 1;
    info.has_alpha = image.channels[3] >= 0;
    info.is_straight = spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0;
    info.is_integer = !spec.format.is_floating_point();
    info.orientation = spec.get_int_attribute("Orientation", 1);
    // OpenImageIO gives a file's own gamma as the exponent that decodes it.
    info.gamma = spec.get_float_attribute("oiio:Gamma", 0.0F);
    if (spec.get_string_attribute("oiio:ColorSpace") == "Linear") info.gamma = 1.0;
    return info;
}

Image* open_image(const char* file, Info* info, char* message) {
    try {
        OIIO::ImageSpec wishes;
        wishes["oiio:UnassociatedAlpha"] = 1;  // colour is multiplied by alpha after it is made linear, not before
        auto image = std::make_unique<Image>();
        image->input = OIIO::ImageInput::open(file, &wishes);
        if (!image->input) {
            say(message, OIIO::geterror());
            return nullptr;
        }
        const OIIO::ImageSpec& spec = image->input->spec();
        if (spec.deep || spec.depth > 1 || spec.nchannels < 1) {
            say(message, "holds deep samples or a volume, not an image");
            return nullptr;
        }
        image->channels = choose_channels(spec);
        *info = describe(spec, *image);
        return image.release();
    } catch (const std::exception& e) {
        say(message, e.what());
        return nullptr;
    }
}

int read_rows(Image* image, std::int64_t begin, std::int64_t end, float* out, char* message) {
    try {
        const OIIO::ImageSpec& spec = image->input->spec();
        const auto width = static_cast<std::size_t>(spec.width);
        const auto stride = static_cast<std::size_t>(spec.nchannels);
        const int top = spec.y + static_cast<int>(begin);
        const int bottom = spec.y + static_cast<int>(end);
        image->row_block.resize(static_cast<std::size_t>(end - begin) * width * stride);
        float* all = image->row_block.data();
        const bool read = spec.tile_width > 0
                              ? image->input->read_tiles(0, 0, spec.x, spec.x + spec.width, top, bottom, spec.z,
                                                         spec.z + 1, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, all)
                              : image->input->read_scanlines(0, 0, top, bottom, spec.z, 0, spec.nchannels,
                                                             OIIO::TypeDesc::FLOAT, all);
        if (!read) {
            say(message, image->input->geterror());
            return 0;
        }
        const std::size_t floats = image->channels[3] >= 0 ? 4 : 3;
        for (std::size_t t = 0; t < static_cast<std::size_t>(end - begin) * width; ++t) {
            for (std::size_t c = 0; c < floats; ++c) {
                out[floats * t + c] = all[stride * t + static_cast<std::size_t>(image->channels[c])];
            }
        }
        return 1;
    } catch (const std::exception& e) {
        say(message, e.what());
        return 0;
    }
}

void close_image(Image* image) { delete image; }

}  // namespace
}  // namespace clerestory::oiio_abi

extern "C" {
__attribute__((visibility("default"))) extern const clerestory::oiio_abi::Functions clerestory_oiio_functions;
const clerestory::oiio_abi::Functions clerestory_oiio_functions = {
    clerestory::oiio_abi::VERSION,
    clerestory::oiio_abi::open_image,
    clerestory::oiio_abi::read_rows,
    clerestory::oiio_abi::close_image,
};
}
