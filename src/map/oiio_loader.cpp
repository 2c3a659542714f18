#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/install_paths.hpp"
#include "base/trust.hpp"
#include "error.hpp"
#include "image.hpp"
#include "map/image_source.hpp"
#include "map/oiio_abi.hpp"
#include "map/placed_source.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr const char* MODULE = "clerestory_oiio.so";

/// Where the module stands; its bare name where it does not. Throws InputError where others could have put it there.
fs::path find_module(const fs::path& image) {
    for (const auto& [folder, program] : install_paths("modules")) {
        std::error_code error;
        fs::path module = folder / MODULE;
        if (!fs::exists(module, error)) continue;
        const std::string doubt = Trust::beside(program).doubt_of_file(module);
        if (doubt.empty()) return module;
        throw refused(
            image, fmt::format("needs {}, which is not loaded: {}; install the program anew", module.string(), doubt));
    }
    return MODULE;
}

/// The module's functions. It stays loaded: OpenImageIO's own threads do not survive being unloaded.
const oiio_abi::Functions& load_module(const fs::path& image, const fs::path& module) {
    const auto fail = [&](const std::string& reason) {
        return InputError(
            fmt::format("{}: {}, which reads TIFF, PNG and JPEG, cannot be used ({}); "
                        "install it beside the program, or convert the image to EXR",
                        image.string(), module.string(), reason));
    };
    // Any other name is looked for in places that do not belong to the program, the current folder among them.
    if (!module.is_absolute()) throw fail("it is not there");
    static std::mutex mutex;
    const std::lock_guard lock(mutex);
    void* handle = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (!handle) throw fail(dlerror());
    const auto* functions = static_cast<const oiio_abi::Functions*>(dlsym(handle, oiio_abi::FUNCTIONS));
    if (!functions) throw fail("it is not this program's module");
    if (functions->version != oiio_abi::VERSION) throw fail("it belongs to another version of the program");
    return *functions;
}

/// The sRGB decoding curve, IEC 61966-2-1.
double linear_from_srgb(double v) { return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4); }

/// Linear values of the 65536 codes of a 16-bit image; those of an 8-bit one are among them (255 divides 65535).
std::vector<float> decoding_table(double gamma) {
    constexpr std::size_t codes = 65536;
    std::vector<float> table(codes);
    for (std::size_t i = 0; i < codes; ++i) {
        const double v = static_cast<double>(i) / (codes - 1);
        table[i] = static_cast<float>(gamma > 0 ? std::pow(v, gamma) : linear_from_srgb(v));
    }
    return table;
}

class OiioSource final : public ImageSource {
  public:
    using Handle = std::unique_ptr<oiio_abi::Image, void (*)(oiio_abi::Image*)>;

    OiioSource(fs::path file, const oiio_abi::Functions& functions, Handle image, const oiio_abi::Info& info)
        : ImageSource(static_cast<std::size_t>(info.width), static_cast<std::size_t>(info.height),
                      static_cast<std::size_t>(info.chunk_rows), info.has_alpha != 0, described(info)),
          file_(std::move(file)),
          functions_(functions),
          image_(std::move(image)),
          is_straight_(info.is_straight != 0) {
        if (info.is_integer) decode_ = decoding_table(info.gamma);
    }

    void read_rows(std::size_t begin, std::size_t end, Rows rgb, Rows alpha) override {
        // Few rows at a time, so that the module's copy stays small whatever the image's size.
        const std::size_t step = std::max(std::size_t{16} / chunk_rows(), std::size_t{1}) * chunk_rows();
        for (std::size_t from = begin; from < end; from += step) {
            const std::size_t to = std::min(from + step, end);
            read_block(from, to);
            for (std::size_t r = from; r < to; ++r)
                store_row(r - from, rgb.row(r), alpha.first ? alpha.row(r) : nullptr);
        }
    }

  private:
    static MapSource described(const oiio_abi::Info& info) {
        MapSource source;
        source.format = info.format;
        source.compression = info.compression;
        source.type = info.type;
        source.part = info.part;
        for (const auto& name : info.channels) {
            if (name[0] != '\0') source.channels.emplace_back(name);
        }
        if (info.is_integer) {
            source.notes.push_back(
                {"eight_bit",
                 fmt::format("holds {} values, decoded {}: what is brighter than white was lost, a sun above "
                             "all; light with the HDR file if there is one",
                             info.type,
                             info.gamma == 1  ? "as linear"
                             : info.gamma > 0 ? fmt::format("with its gamma of {:.3g}", info.gamma)
                                              : "through the sRGB curve")});
        }
        return source;
    }

    [[nodiscard]] std::size_t floats() const { return has_alpha() ? 4 : 3; }

    void read_block(std::size_t begin, std::size_t end) {
        block_.resize((end - begin) * width() * floats());
        std::array<char, oiio_abi::MESSAGE_SIZE> message{};
        if (!functions_.read(image_.get(), static_cast<std::int64_t>(begin), static_cast<std::int64_t>(end),
                             block_.data(), message.data())) {
            throw damaged(file_, message.data());
        }
    }

    void store_row(std::size_t r, float* rgb, float* alpha) const {
        const float* in = block_.data() + r * width() * floats();
        for (std::size_t x = 0; x < width(); ++x, in += floats(), rgb += 3) {
            for (std::size_t c = 0; c < 3; ++c) rgb[c] = decode_.empty() ? in[c] : decoded(in[c]);
            if (alpha) alpha[x] = in[3];
            if (alpha && is_straight_) {
                for (std::size_t c = 0; c < 3; ++c) rgb[c] *= in[3];
            }
        }
    }

    [[nodiscard]] float decoded(float code) const {
        const float last = static_cast<float>(decode_.size() - 1);
        return decode_[static_cast<std::size_t>(std::lround(std::clamp(code, 0.0F, 1.0F) * last))];
    }

    fs::path file_;
    const oiio_abi::Functions& functions_;
    Handle image_;
    bool is_straight_;           ///< whether colour has yet to be multiplied by alpha, as EXR's always is
    std::vector<float> decode_;  ///< linear value of each code; empty for floats, which are linear already
    std::vector<float> block_;
};

}  // namespace

std::unique_ptr<ImageSource> open_oiio(const fs::path& file, oiio_abi::Format format, const ReadOptions& options) {
    const fs::path module = options.oiio_module.empty() ? find_module(file) : options.oiio_module;
    const oiio_abi::Functions& functions = load_module(file, module);
    oiio_abi::Info info{};
    std::array<char, oiio_abi::MESSAGE_SIZE> message{};
    if (!options.layer.empty()) {
        throw refused(file, "has no layers; --layer is for EXR files");
    }
    OiioSource::Handle image(
        functions.open(file.c_str(), format, options.part.value_or(oiio_abi::ANY_PART), &info, message.data()),
        functions.close);
    if (!image) throw refused(file, message.data());
    const auto size = [](std::int64_t n) { return n < 0 ? std::size_t{0} : static_cast<std::size_t>(n); };
    check_size(file, size(info.width), size(info.height), options.limits);
    if (info.orientation != 1) {
        throw InputError(
            fmt::format("{}: is stored turned or mirrored (orientation {}); write it upright first, "
                        "for instance with oiiotool --reorient",
                        file.string(), info.orientation));
    }
    Window data{info.x, info.y, size(info.width), size(info.height)};
    const Window display{info.full_x, info.full_y, size(info.full_width), size(info.full_height)};
    // TIFF's position alone, without the size of a whole, is the place on a printed page.
    if (data.width == display.width && data.height == display.height) data = display;
    return placed(file, std::make_unique<OiioSource>(file, functions, std::move(image), info), data, display,
                  options.limits);
}

}  // namespace clerestory
