#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputPart.h>
#include <ImfIntAttribute.h>
#include <ImfMultiPartInputFile.h>
#include <ImfOutputFile.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <ImfTiledInputPart.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/atomic_file.hpp"
#include "error.hpp"
#include "image.hpp"
#include "map/image_source.hpp"

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

/// Which channels of the file are red, green, blue and alpha; the same name thrice for a grey image, "" for no alpha.
struct Channels {
    std::array<std::string, 3> rgb;
    std::string alpha;
    [[nodiscard]] bool grey() const { return rgb[0] == rgb[1]; }
};

std::vector<std::string> channel_names(const Imf::Header& header) {
    std::vector<std::string> names;
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c) names.emplace_back(c.name());
    return names;
}

/// The colour channels of the layer `prefix` ("" or "name."): R, G and B, or Y alone.
std::optional<Channels> channels_of_layer(const Imf::ChannelList& list, const std::string& prefix) {
    const auto has = [&](const char* name) { return list.findChannel(prefix + name) != nullptr; };
    const std::string alpha = has("A") ? prefix + "A" : "";
    if (has("R") && has("G") && has("B")) return Channels{{prefix + "R", prefix + "G", prefix + "B"}, alpha};
    const bool luminance = has("Y") && !has("X") && !has("Z");
    if (luminance) return Channels{{prefix + "Y", prefix + "Y", prefix + "Y"}, alpha};
    return std::nullopt;
}

/// R, G, B or Y of the unnamed layer, else of the first named one, else the first three channels (or the first alone).
Channels choose_channels(const Imf::Header& header) {
    if (auto found = channels_of_layer(header.channels(), "")) return *found;
    std::vector<std::string> names = channel_names(header);
    for (const std::string& name : names) {
        const std::size_t dot = name.rfind('.');
        if (dot == std::string::npos) continue;
        if (auto found = channels_of_layer(header.channels(), name.substr(0, dot + 1))) return *found;
    }
    const bool alpha = std::erase(names, "A") > 0;
    if (names.empty()) names.emplace_back("A");
    if (names.size() < 3) return {{names[0], names[0], names[0]}, alpha ? "A" : ""};
    return {{names[0], names[1], names[2]}, alpha ? "A" : ""};
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
    return InputError(fmt::format("{}: damaged or cut short ({}); get the file anew", file.string(), line));
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

/// An EXR file that has been opened: its first part that is an image rather than deep samples.
struct OpenFile {
    OpenFile(const fs::path& file, const ReadLimits& limits)
        : parts(file.c_str(), static_cast<int>(std::max(1U, std::thread::hardware_concurrency()))) {
        while (part < parts.parts() && !is_flat(parts.header(part))) ++part;
        if (part == parts.parts()) {
            throw InputError(fmt::format("{}: holds deep samples only; flatten it to an image first", file.string()));
        }
        const Imath::Box2i window = header().dataWindow();
        width = extent(window.min.x, window.max.x);
        height = extent(window.min.y, window.max.y);
        check_size(file, width, height, limits);
        if (header().channels().findChannel("RY") && header().channels().findChannel("BY")) {
            throw InputError(
                fmt::format("{}: stores luminance and chroma (Y, RY, BY); write it as R, G and B", file.string()));
        }
        channels = choose_channels(header());
        for (const std::string& name : channels.rgb) check_sampling(file, name);
        if (!channels.alpha.empty()) check_sampling(file, channels.alpha);
        if (!parts.partComplete(part)) {
            throw InputError(
                fmt::format("{}: cut short, blocks of pixels are missing; get the file anew", file.string()));
        }
    }

    [[nodiscard]] const Imf::Header& header() const { return parts.header(part); }
    [[nodiscard]] bool tiled() const { return header().hasTileDescription(); }
    [[nodiscard]] std::size_t chunk_rows() const {
        return tiled() ? header().tileDescription().ySize : rows_per_block(header().compression());
    }

    void check_sampling(const fs::path& file, const std::string& name) const {
        const Imf::Channel& channel = header().channels()[name];
        if (channel.xSampling == 1 && channel.ySampling == 1) return;
        throw InputError(fmt::format("{}: channel {} holds one value per {} x {} texels; write it with full resolution",
                                     file.string(), name, channel.xSampling, channel.ySampling));
    }

    Imf::MultiPartInputFile parts;
    int part = 0;
    std::size_t width = 0;
    std::size_t height = 0;
    Channels channels;
};

class ExrSource final : public ImageSource {
  public:
    ExrSource(fs::path file, std::unique_ptr<OpenFile> opened)
        : ImageSource(opened->width, opened->height, opened->chunk_rows(), !opened->channels.alpha.empty()),
          file_(std::move(file)),
          threads_(opened->width * opened->height),
          opened_(std::move(opened)) {
        if (opened_->tiled()) {
            tiles_.emplace(opened_->parts, opened_->part);
        } else {
            lines_.emplace(opened_->parts, opened_->part);
        }
    }

    [[nodiscard]] bool rings() const noexcept override {
        const Imf::Compression compression = opened_->header().compression();
        return compression == Imf::DWAA_COMPRESSION || compression == Imf::DWAB_COMPRESSION;
    }

    void read_rows(std::size_t begin, std::size_t end, Rows rgb, Rows alpha) override {
        guarded(file_, [&] {
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
        if (!opened_->channels.grey()) return;
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
        const Channels& channels = opened_->channels;
        Imf::FrameBuffer buffer;
        for (std::size_t c = 0; c < (channels.grey() ? 1U : 3U); ++c) buffer.insert(channels.rgb[c], slice(rgb, c, 3));
        if (alpha.first && has_alpha()) buffer.insert(channels.alpha, slice(alpha, 0, 1));
        return buffer;
    }

    fs::path file_;
    PoolThreads threads_;
    std::unique_ptr<OpenFile> opened_;
    std::optional<Imf::InputPart> lines_;
    std::optional<Imf::TiledInputPart> tiles_;
};

/// A file in memory: OpenEXR's own stream says nothing when a disk is found full at its last flush.
class MemoryStream final : public Imf::OStream {
  public:
    MemoryStream() : OStream("memory") {}
    void write(const char bytes[], int count) override {
        const auto size = static_cast<std::size_t>(count);
        if (position_ + size > bytes_.size()) bytes_.resize(position_ + size);
        std::memcpy(bytes_.data() + position_, bytes, size);
        position_ += size;
    }
    std::uint64_t tellp() override { return position_; }
    void seekp(std::uint64_t position) override { position_ = position; }
    [[nodiscard]] const std::vector<char>& bytes() const { return bytes_; }
    void reserve(std::size_t size) { bytes_.reserve(size); }

  private:
    std::vector<char> bytes_;
    std::size_t position_ = 0;
};

Imf::Header exr_header(int width, int height, const std::vector<std::string>& channels, const Header& values) {
    Imf::Header header(width, height);
    // Noisy float pixels hardly shrink: of a 511 x 511 sphere RLE saves 30 % for 4 times the time of writing it
    // plainly, ZIP 45 % for 18 times.
    header.compression() = Imf::NO_COMPRESSION;
    for (const std::string& name : channels) header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    for (const auto& [name, value] : values) {
        if (value.is_number) {
            header.insert(name, Imf::DoubleAttribute(value.number));
        } else {
            header.insert(name, Imf::StringAttribute(value.text));
        }
    }
    return header;
}

}  // namespace

std::unique_ptr<ImageSource> open_exr(const fs::path& file, const ReadLimits& limits) {
    return guarded(file, [&]() -> std::unique_ptr<ImageSource> {
        check_exr_attributes(file);
        return std::make_unique<ExrSource>(file, std::make_unique<OpenFile>(file, limits));
    });
}

void write_exr(const fs::path& file, std::size_t width, std::size_t height, const float* rgba, const Header& header) {
    write_exr_channels(file, width, height, {"R", "G", "B", "A"}, rgba, header);
}

void write_exr_channels(const fs::path& file, std::size_t width, std::size_t height,
                        const std::vector<std::string>& channels, const float* pixels, const Header& header) {
    constexpr std::size_t largest = std::numeric_limits<int>::max() / 2;
    if (width == 0 || height == 0 || width > largest || height > largest) {
        throw OutputError(fmt::format("{}: EXR cannot hold {} x {} pixels", file.string(), width, height));
    }
    MemoryStream stream;
    try {
        const std::size_t stride = channels.size() * sizeof(float);
        stream.reserve(width * height * stride);
        Imf::OutputFile out(stream, exr_header(static_cast<int>(width), static_cast<int>(height), channels, header), 0);
        Imf::FrameBuffer buffer;
        std::size_t offset = 0;
        for (const std::string& name : channels) {
            // OpenEXR takes a pointer that it could write through, and only reads.
            char* base = reinterpret_cast<char*>(const_cast<float*>(pixels + offset++));
            buffer.insert(name, Imf::Slice(Imf::FLOAT, base, stride, stride * width));
        }
        out.setFrameBuffer(buffer);
        out.writePixels(static_cast<int>(height));
    } catch (const std::exception& e) {
        throw OutputError(fmt::format("{}: EXR encoding failed: {}", file.string(), e.what()));
    }
    write_bytes(file, stream.bytes());
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

bool names_chromaticities(const fs::path& file) {
    return is_exr(file) && guarded(file, [&] {
               const Imf::MultiPartInputFile parts(file.c_str(), 0);
               return Imf::hasChromaticities(parts.header(0));
           });
}

}  // namespace clerestory
