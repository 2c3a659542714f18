#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "map/file_check.hpp"
#include "map/oiio_abi.hpp"

/// The only file that includes OpenImageIO: a module of its own, because merely loading that library takes about 0.2 s.
namespace clerestory::oiio_abi {

struct Image {
    std::unique_ptr<OIIO::ImageInput> input;
    std::unique_ptr<file_check::FileCheck> check;  ///< gone once the texels have been checked
    std::array<int, 4> channels{};                 ///< red, green, blue, alpha; alpha -1 where there is none
    std::vector<float> row_block;                  ///< all the file's channels of the rows being read
};

namespace {

void say(char* message, const std::string& text) {
    std::snprintf(message, MESSAGE_SIZE, "%s", text.substr(0, text.find('\n')).c_str());
}

void say_damage(char* message, const std::string& how) {
    say(message, "damaged or cut short (" + how + "); get the file anew");
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

/// R, G and B by name, else the only one that is not alpha, thrice. False where there is no such set.
bool choose_channels(const OIIO::ImageSpec& spec, std::array<int, 4>& chosen) {
    const int alpha = spec.nchannels > 1 ? spec.alpha_channel : -1;
    chosen = {find_channel(spec, "red"), find_channel(spec, "green"), find_channel(spec, "blue"), alpha};
    if (chosen[0] >= 0 && chosen[1] >= 0 && chosen[2] >= 0) return true;
    if (spec.nchannels - (alpha >= 0 ? 1 : 0) != 1) return false;
    const int grey = alpha == 0 ? 1 : 0;
    chosen = {grey, grey, grey, alpha};
    return true;
}

/// TIFF's codes for the two encodings of a wide range that OpenImageIO cuts to 8 bits.
bool is_log_encoded(const OIIO::ImageSpec& spec) {
    constexpr int LOGL = 32844;
    constexpr int LOGLUV = 32845;
    const int photometric = spec.get_int_attribute("tiff:PhotometricInterpretation", 0);
    return photometric == LOGL || photometric == LOGLUV;
}

/// TIFF's mark of a smaller copy of another page.
bool is_thumbnail(const OIIO::ImageSpec& spec) {
    constexpr int REDUCED = 1;
    return (spec.get_int_attribute("tiff:subfiletype", 0) & REDUCED) != 0;
}

/// Turns to the part that was asked for; false, with a message, where there is none.
bool seek_part(OIIO::ImageInput& input, int part, char* message) {
    if (part != ANY_PART) {
        if (input.seek_subimage(part, 0)) return true;
        say(message, "has no part " + std::to_string(part) + "; parts are counted from 0");
        return false;
    }
    for (int p = 0; is_thumbnail(input.spec());) {
        if (!input.seek_subimage(++p, 0)) return input.seek_subimage(0, 0);  // a file of thumbnails
    }
    return true;
}

/// Why an image cannot be a map; empty where it can.
std::string what_bars(const OIIO::ImageSpec& spec, std::array<int, 4>& channels) {
    if (spec.deep || spec.depth > 1 || spec.nchannels < 1) return "holds deep samples or a volume, not an image";
    if (is_log_encoded(spec))
        return "is encoded as LogLuv or LogL, which would lose its range; write it as 32-bit float";
    if (choose_channels(spec, channels)) return {};
    std::string names;
    for (const std::string& name : spec.channelnames) names += (names.empty() ? "" : ", ") + name;
    return "has no R, G, B and not one grey channel alone, but " + names;
}

template <std::size_t N>
void put(char (&to)[N], const std::string& text) {
    std::snprintf(to, N, "%s", text.c_str());
}

/// Of formats that have one only, which OpenImageIO doesn't name.
std::string own_compression(const std::string& format) {
    if (format == "png") return "zip";
    return format == "jpeg" ? "jpeg" : "none";
}

Info describe(const OIIO::ImageSpec& spec, const Image& image) {
    Info info{};
    info.x = spec.x;
    info.y = spec.y;
    info.width = spec.width;
    info.height = spec.height;
    info.full_x = spec.full_x;
    info.full_y = spec.full_y;
    info.full_width = spec.full_width;
    info.full_height = spec.full_height;
    info.part = image.input->current_subimage();
    info.chunk_rows = spec.tile_height > 0 ? spec.tile_height : 1;
    info.has_alpha = image.channels[3] >= 0;
    info.is_straight = spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0;
    info.is_integer = !spec.format.is_floating_point();
    info.orientation = spec.get_int_attribute("Orientation", 1);
    // OpenImageIO gives a file's own gamma as the exponent that decodes it.
    info.gamma = spec.get_float_attribute("oiio:Gamma", 0.0F);
    if (spec.get_string_attribute("oiio:ColorSpace") == "Linear") info.gamma = 1.0;
    put(info.format, image.input->format_name());
    put(info.compression, spec.get_string_attribute("compression", own_compression(info.format)));
    put(info.type, spec.format.c_str());
    const bool grey = image.channels[0] == image.channels[1];
    for (std::size_t c = 0; c < (grey ? 1 : 3); ++c) put(info.channels[c], spec.channel_name(image.channels[c]));
    return info;
}

std::unique_ptr<file_check::FileCheck> check_of(const char* file, std::int32_t format) {
    if (format == FORMAT_TIFF) return file_check::check_tiff(file);
    return format == FORMAT_PNG ? file_check::check_png(file) : file_check::check_jpeg(file);
}

/// OpenImageIO's reader of one format, whatever the file's name: left to choose, it tries dozens, looks for more in
/// folders, and takes any file called x.null for a black picture.
std::unique_ptr<OIIO::ImageInput> open_input(const char* file, std::int32_t format, char* message) {
    constexpr std::array<const char*, 3> NAMES = {"tiff", "png", "jpeg"};
    OIIO::ImageSpec wishes;
    wishes["oiio:UnassociatedAlpha"] = 1;  // colour is multiplied by alpha after it is made linear, not before
    std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(NAMES.at(static_cast<std::size_t>(format)));
    OIIO::ImageSpec spec;
    if (input && input->open(file, spec, wishes)) return input;
    const std::string reason = input ? input->geterror() : OIIO::geterror();
    say(message, "is not read by OpenImageIO (" + reason.substr(0, reason.find('\n')) + "); write it as 32-bit float");
    return nullptr;
}

Image* open_image(const char* file, std::int32_t format, int part, Info* info, char* message) {
    try {
        auto image = std::make_unique<Image>();
        image->check = check_of(file, format);
        image->input = open_input(file, format, message);
        if (!image->input || !seek_part(*image->input, part, message)) return nullptr;
        const OIIO::ImageSpec& spec = image->input->spec();
        if (const std::string bar = what_bars(spec, image->channels); !bar.empty()) {
            say(message, bar);
            return nullptr;
        }
        image->check->check_page(image->input->current_subimage());
        *info = describe(spec, *image);
        return image.release();
    } catch (const file_check::Damage& damage) {
        say_damage(message, damage.what());
    } catch (const file_check::Refusal& refusal) {
        say(message, refusal.what());
    } catch (const std::exception& e) {
        say(message, std::string("could not be opened (") + e.what() + ")");
    }
    return nullptr;
}

int read_rows(Image* image, std::int64_t begin, std::int64_t end, float* out, char* message) {
    try {
        if (image->check) {
            image->check->check_texels();
            image->check.reset();
        }
        const OIIO::ImageSpec& spec = image->input->spec();
        const int part = image->input->current_subimage();
        const auto width = static_cast<std::size_t>(spec.width);
        const auto stride = static_cast<std::size_t>(spec.nchannels);
        const int top = spec.y + static_cast<int>(begin);
        const int bottom = spec.y + static_cast<int>(end);
        image->row_block.resize(static_cast<std::size_t>(end - begin) * width * stride);
        float* all = image->row_block.data();
        const bool read = spec.tile_width > 0
                              ? image->input->read_tiles(part, 0, spec.x, spec.x + spec.width, top, bottom, spec.z,
                                                         spec.z + 1, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, all)
                              : image->input->read_scanlines(part, 0, top, bottom, spec.z, 0, spec.nchannels,
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
