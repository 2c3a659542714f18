#include <ImfChannelList.h>
#include <ImfChromaticities.h>
#include <ImfDoubleAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfPartType.h>
#include <ImfRgbaFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <ImfTiledInputPart.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/text_escape.hpp"
#include "error.hpp"
#include "image.hpp"
#include "map/exr_layers.hpp"
#include "map/image_source.hpp"
#include "map/placed_source.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// From this many texels on, OpenEXR's threads save more than starting them costs.
constexpr std::size_t THREADED_TEXELS = std::size_t{1} << 18;

int decoder_threads(std::size_t texels) {
    return texels < THREADED_TEXELS ? 0 : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
}

/// Threads in OpenEXR's pool while an image is read that repays them. The pool belongs to the process, and whoever
/// writes hands each line to its threads where there are any, which takes ten times as long as writing a picture's
/// lines does: so the last reader leaves the pool as the first one found it.
class PoolThreads {
  public:
    explicit PoolThreads(std::size_t texels) : wanted_(decoder_threads(texels)) {
        if (wanted_ == 0) return;
        const std::lock_guard lock(mutex);
        if (readers++ == 0) before = Imf::globalThreadCount();
        if (Imf::globalThreadCount() < wanted_) Imf::setGlobalThreadCount(wanted_);
    }
    PoolThreads(const PoolThreads&) = delete;
    PoolThreads& operator=(const PoolThreads&) = delete;
    ~PoolThreads() {
        if (wanted_ == 0) return;
        const std::lock_guard lock(mutex);
        if (--readers == 0) Imf::setGlobalThreadCount(before);
    }

  private:
    static inline std::mutex mutex;
    static inline int readers = 0;
    static inline int before = 0;
    int wanted_;
};

/// Rows that one compressed block holds.
std::size_t rows_per_block(Imf::Compression compression) {
    switch (compression) {
        case Imf::ZIP_COMPRESSION:
        case Imf::PXR24_COMPRESSION:
            return 16;
        case Imf::PIZ_COMPRESSION:
        case Imf::B44_COMPRESSION:
        case Imf::B44A_COMPRESSION:
        case Imf::DWAA_COMPRESSION:
            return 32;
        case Imf::DWAB_COMPRESSION:
            return 256;
        default:
            return 1;
    }
}

bool is_flat(const Imf::Header& header) {
    return !header.hasType() || header.type() == Imf::SCANLINEIMAGE || header.type() == Imf::TILEDIMAGE;
}

/// What OpenEXR said, without the file's name, which our own line begins with.
InputError unreadable(const fs::path& file, std::string_view reason) {
    const std::string named = fmt::format("\"{}\". ", file.string());
    for (const std::string_view prefix :
         {std::string_view("Cannot read image file "), std::string_view("Error reading pixel data from image file "),
          std::string_view(named)}) {
        if (reason.substr(0, prefix.size()) == prefix) reason.remove_prefix(prefix.size());
    }
    while (!reason.empty() && (reason.back() == '.' || reason.back() == '\n')) reason.remove_suffix(1);
    std::string line(reason);
    std::replace(line.begin(), line.end(), '\n', ' ');
    return damaged(file, line);
}

/// Runs `work`, turning what OpenEXR and the allocator throw into one clear line.
template <class Work>
auto guarded(const fs::path& file, Work work) {
    try {
        return work();
    } catch (const Error&) {
        throw;
    } catch (const std::bad_alloc&) {
        throw InputError(fmt::format("{}: not enough memory to read it; use a smaller image", file.string()));
    } catch (const std::exception& e) {
        throw unreadable(file, e.what());
    }
}

std::size_t extent(int low, int high) {
    const std::int64_t size = std::int64_t{high} - low + 1;
    return size < 0 ? 0 : static_cast<std::size_t>(size);
}

std::string compression_name(Imf::Compression compression) {
    static constexpr std::array<const char*, 10> NAMES = {"none",  "rle", "zips", "zip",  "piz",
                                                          "pxr24", "b44", "b44a", "dwaa", "dwab"};
    const auto index = static_cast<std::size_t>(compression);
    return index < NAMES.size() ? NAMES.at(index) : "unknown";
}

std::string type_name(Imf::PixelType type) {
    return type == Imf::HALF ? "half" : type == Imf::FLOAT ? "float" : "uint";
}

std::vector<ExrPart> parts_of(const Imf::MultiPartInputFile& file) {
    std::vector<ExrPart> parts;
    for (int p = 0; p < file.parts(); ++p) {
        const Imf::Header& header = file.header(p);
        ExrPart part{header.hasName() ? header.name() : "", is_flat(header), {}};
        for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
            part.channels.emplace_back(c.name());
        }
        parts.push_back(std::move(part));
    }
    return parts;
}

Window window_of(const Imath::Box2i& box) {
    return {box.min.x, box.min.y, extent(box.min.x, box.max.x), extent(box.min.y, box.max.y)};
}

bool are_near(const Imf::Chromaticities& a, const Imf::Chromaticities& b) {
    constexpr float ROUNDING = 2e-3F;  // writers give three digits, and disagree on the last
    const auto near = [](const Imath::V2f& p, const Imath::V2f& q) { return (p - q).length() <= ROUNDING; };
    return near(a.red, b.red) && near(a.green, b.green) && near(a.blue, b.blue) && near(a.white, b.white);
}

/// Whether the header's primaries are Rec. 709's, as they are where it names none; also as ICC profiles write them,
/// adapted to D50 (the sRGB profile of IEC 61966-2-1), which is another name for the same colours.
bool has_rec709_primaries(const Imf::Header& header) {
    static const Imf::Chromaticities ADAPTED({0.6484F, 0.3309F}, {0.3212F, 0.5979F}, {0.1559F, 0.0661F},
                                             {0.3457F, 0.3585F});
    if (!Imf::hasChromaticities(header)) return true;
    const Imf::Chromaticities& found = Imf::chromaticities(header);
    return are_near(found, Imf::Chromaticities()) || are_near(found, ADAPTED);
}

/// An EXR file that has been opened, with the part and layer that light.
struct OpenFile {
    OpenFile(const fs::path& name, const ReadOptions& options)
        : file(name), parts(file.c_str(), static_cast<int>(std::max(1U, std::thread::hardware_concurrency()))) {
        chosen = choose_layer(file, parts_of(parts), {options.layer, options.part});
        check_size(file, window().width, window().height, options.limits);
        check_sampling();
        if (!parts.partComplete(chosen.part)) {
            throw refused(file, "cut short, blocks of pixels are missing; get the file anew");
        }
    }

    [[nodiscard]] const Imf::Header& header() const { return parts.header(chosen.part); }
    [[nodiscard]] Window window() const { return window_of(header().dataWindow()); }
    [[nodiscard]] Window display() const { return window_of(header().displayWindow()); }
    [[nodiscard]] bool tiled() const { return header().hasTileDescription(); }
    [[nodiscard]] bool grey() const { return chosen.kind == LayerKind::luminance; }
    [[nodiscard]] std::size_t chunk_rows() const {
        return tiled() ? header().tileDescription().ySize : rows_per_block(header().compression());
    }

    void check_sampling() const {
        const bool chroma = chosen.kind == LayerKind::luminance_chroma;
        for (std::size_t c = 0; c < chosen.channels.size(); ++c) {
            check_sampling_of(chosen.channels[c], chroma && c > 0 ? CHROMA_SAMPLING : 1);
        }
        if (!chosen.alpha.empty()) check_sampling_of(chosen.alpha, 1);
    }

    void check_sampling_of(const std::string& name, int expected) const {
        const Imf::Channel& channel = header().channels()[name];
        if (channel.xSampling == expected && channel.ySampling == expected) return;
        throw refused(file, fmt::format("channel {} holds one value per {} x {} texels; write R, G and B with full "
                                        "resolution",
                                        one_line(name), channel.xSampling, channel.ySampling));
    }

    [[nodiscard]] MapSource described() const {
        MapSource source;
        source.format = "OpenEXR";
        source.compression = compression_name(header().compression());
        source.type = type_name(header().channels()[chosen.channels[0]].type);
        source.part = chosen.part;
        source.layer = chosen.layer;
        source.channels.assign(chosen.channels.begin(), chosen.channels.begin() + (grey() ? 1 : 3));
        source.plain = is_plain();
        if (!has_rec709_primaries(header())) {
            source.notes.push_back({"other_primaries",
                                    "its chromaticities are not Rec. 709's; R, G and B are taken as "
                                    "they stand"});
        }
        if (!chosen.passed_over.empty()) {
            source.notes.push_back(
                {"first_of_several",
                 fmt::format("lit by part {}, the first that could; --part or --layer chooses another, such as {}",
                             chosen.part, chosen.passed_over.front())});
        }
        return source;
    }

    /// Nothing in the file that a renderer could read in another way: one part with R, G and B alone, that cover the
    /// picture.
    [[nodiscard]] bool is_plain() const {
        std::size_t channels = 0;
        for (auto c = header().channels().begin(); c != header().channels().end(); ++c) ++channels;
        // Others convert by whatever primaries are named.
        const bool unconverted =
            !Imf::hasChromaticities(header()) || are_near(Imf::chromaticities(header()), Imf::Chromaticities());
        return parts.parts() == 1 && channels == 3 && !tiled() && unconverted &&
               chosen.channels == std::array<std::string, 3>{"R", "G", "B"} && window() == display() &&
               header().dataWindow().min == Imath::V2i(0, 0) && header().channels()["R"].type != Imf::UINT;
    }

    static constexpr int CHROMA_SAMPLING = 2;  ///< RgbaInputFile's, and RgbaOutputFile's

    fs::path file;
    Imf::MultiPartInputFile parts;
    ChosenLayer chosen;
};

class ExrSource final : public ImageSource {
  public:
    explicit ExrSource(std::unique_ptr<OpenFile> opened)
        : ImageSource(opened->window().width, opened->window().height, opened->chunk_rows(),
                      !opened->chosen.alpha.empty(), opened->described()),
          threads_(width() * height()),
          opened_(std::move(opened)) {
        if (opened_->tiled()) {
            tiles_.emplace(opened_->parts, opened_->chosen.part);
        } else {
            lines_.emplace(opened_->parts, opened_->chosen.part);
        }
    }

    [[nodiscard]] bool rings() const noexcept override {
        const Imf::Compression compression = opened_->header().compression();
        return compression == Imf::DWAA_COMPRESSION || compression == Imf::DWAB_COMPRESSION;
    }

    void read_rows(std::size_t begin, std::size_t end, Rows rgb, Rows alpha) override {
        guarded(opened_->file, [&] {
            if (tiles_) {
                const std::size_t side = chunk_rows();
                tiles_->setFrameBuffer(frame(rgb, alpha));
                tiles_->readTiles(0, tiles_->numXTiles() - 1, static_cast<int>(begin / side),
                                  static_cast<int>((end + side - 1) / side) - 1);
            } else {
                const int top = opened_->header().dataWindow().min.y;
                lines_->setFrameBuffer(frame(rgb, alpha));
                lines_->readPixels(top + static_cast<int>(begin), top + static_cast<int>(end) - 1);
            }
        });
        if (!opened_->grey()) return;
        for (std::size_t r = begin; r < end; ++r) {
            float* row = rgb.row(r);
            for (std::size_t x = 0; x < width(); ++x) row[3 * x + 1] = row[3 * x + 2] = row[3 * x];
        }
    }

  private:
    /// A slice that puts the data window's first texel at rows.first + offset. Strides are added modulo 2^64, so that a
    /// negative one works.
    [[nodiscard]] Imf::Slice slice(Rows rows, std::size_t offset, std::size_t texel_floats) const {
        const Imath::V2i origin = opened_->header().dataWindow().min;
        const std::size_t x_stride = texel_floats * sizeof(float);
        const auto y_stride = static_cast<std::size_t>(rows.stride) * sizeof(float);
        auto base = reinterpret_cast<std::uintptr_t>(rows.first + offset);
        base -= static_cast<std::size_t>(std::int64_t{origin.x}) * x_stride;
        base -= static_cast<std::size_t>(std::int64_t{origin.y}) * y_stride;
        // The data window may begin anywhere, so that the origin that OpenEXR asks for lies outside the buffer.
        return {Imf::FLOAT, reinterpret_cast<char*>(base), x_stride, y_stride};  // NOLINT(performance-no-int-to-ptr)
    }

    [[nodiscard]] Imf::FrameBuffer frame(Rows rgb, Rows alpha) const {
        const ChosenLayer& chosen = opened_->chosen;
        Imf::FrameBuffer buffer;
        for (std::size_t c = 0; c < (opened_->grey() ? 1U : 3U); ++c) {
            buffer.insert(chosen.channels[c], slice(rgb, c, 3));
        }
        if (alpha.first && has_alpha()) buffer.insert(chosen.alpha, slice(alpha, 0, 1));
        return buffer;
    }

    PoolThreads threads_;
    std::unique_ptr<OpenFile> opened_;
    std::optional<Imf::InputPart> lines_;
    std::optional<Imf::TiledInputPart> tiles_;
};

/// Luminance and chroma at half the resolution, which OpenEXR makes R, G and B of, in half floats.
class ChromaSource final : public ImageSource {
  public:
    explicit ChromaSource(const OpenFile& opened)
        : ImageSource(opened.window().width, opened.window().height, 1, !opened.chosen.alpha.empty(),
                      opened.described()),
          file_(opened.file),
          window_(opened.window()),
          threads_(width() * height()),
          pixels_(file_.c_str(), opened.chosen.layer) {}

    void read_rows(std::size_t begin, std::size_t end, Rows rgb, Rows alpha) override {
        std::vector<Imf::Rgba> row(width());
        guarded(file_, [&] {
            for (std::size_t r = begin; r < end; ++r) {
                const auto y = static_cast<int>(window_.y + static_cast<std::int64_t>(r));
                // All rows go to the one: a stride of 0.
                pixels_.setFrameBuffer(row.data() - window_.x, 1, 0);
                pixels_.readPixels(y);
                store(row, rgb.row(r), alpha.first ? alpha.row(r) : nullptr);
            }
        });
    }

  private:
    static void store(const std::vector<Imf::Rgba>& row, float* rgb, float* alpha) {
        for (std::size_t x = 0; x < row.size(); ++x) {
            rgb[3 * x] = row[x].r;
            rgb[3 * x + 1] = row[x].g;
            rgb[3 * x + 2] = row[x].b;
            if (alpha) alpha[x] = row[x].a;
        }
    }

    fs::path file_;
    Window window_;
    PoolThreads threads_;
    Imf::RgbaInputFile pixels_;
};

/// RgbaInputFile reads the first part alone, and channels that are spelt as it spells them.
void check_chroma(const OpenFile& opened) {
    const std::string prefix = opened.chosen.layer.empty() ? "" : opened.chosen.layer + ".";
    const std::array<std::string, 3> spelt = {prefix + "Y", prefix + "RY", prefix + "BY"};
    if (opened.chosen.part == 0 && opened.chosen.channels == spelt) return;
    throw refused(opened.file, fmt::format("stores luminance and chroma ({}) in a way that cannot be decoded; write it "
                                           "as R, G and B",
                                           one_line(fmt::format("{}", fmt::join(opened.chosen.channels, ", ")))));
}

std::unique_ptr<ImageSource> open_layer(std::unique_ptr<OpenFile> opened) {
    if (opened->chosen.kind != LayerKind::luminance_chroma) return std::make_unique<ExrSource>(std::move(opened));
    check_chroma(*opened);
    return std::make_unique<ChromaSource>(*opened);
}

}  // namespace

std::unique_ptr<ImageSource> open_exr(const fs::path& file, const ReadOptions& options) {
    return guarded(file, [&] {
        check_exr_attributes(file);
        auto opened = std::make_unique<OpenFile>(file, options);
        const Imf::Header& header = opened->header();
        const bool cube = Imf::hasEnvmap(header) && Imf::envmap(header) == Imf::ENVMAP_CUBE;
        const Window data = opened->window();
        const Window display = opened->display();
        std::unique_ptr<ImageSource> source = open_layer(std::move(opened));
        if (cube) source->mark_cube();
        return placed(file, std::move(source), data, display, options.limits);
    });
}

Header read_exr_header(const fs::path& file) {
    if (!is_exr(file))
        throw InputError(fmt::format("{}: is not an EXR file, so it has no parameters to read", file.string()));
    return guarded(file, [&] {
        check_exr_attributes(file);
        const Imf::MultiPartInputFile parts(file.c_str(), 0);
        Header values;
        for (auto a = parts.header(0).begin(); a != parts.header(0).end(); ++a) {
            HeaderValue value;
            if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute())) {
                value.text = text->value();
            } else if (const auto* real = dynamic_cast<const Imf::DoubleAttribute*>(&a.attribute())) {
                value.number = real->value();
                value.is_number = true;
            } else {
                continue;
            }
            values.emplace(a.name(), value);
        }
        return values;
    });
}

}  // namespace clerestory
