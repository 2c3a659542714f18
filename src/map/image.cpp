#include "image.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <exception>
#include <fstream>
#include <mutex>
#include <new>
#include <stop_token>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "base/available_memory.hpp"
#include "base/huge_pages.hpp"
#include "base/text_escape.hpp"
#include "error.hpp"
#include "map/image_source.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// Texels of a band: enough work for the decoder's threads and for whoever takes the rows, small beside a large map.
constexpr std::size_t BAND_TEXELS = std::size_t{1} << 21;
/// Compressed blocks that a band holds at least, so that several threads have some to decode.
constexpr std::size_t BAND_BLOCKS = 8;

/// The first bytes of a file, which tell its kind whatever its name says.
enum class Kind { exr, radiance, pfm, tiff, png, jpeg, other };

struct Magic {
    std::string_view bytes;
    Kind kind;
};
constexpr std::array<Magic, 8> MAGICS = {{{{"\x76\x2f\x31\x01", 4}, Kind::exr},  // 20000630, little-endian
                                          {"#?", Kind::radiance},
                                          {{"II*\0", 4}, Kind::tiff},
                                          {{"MM\0*", 4}, Kind::tiff},
                                          {{"II+\0", 4}, Kind::tiff},  // BigTIFF: 43
                                          {{"MM\0+", 4}, Kind::tiff},
                                          {"\x89PNG\r\n\x1a\n", Kind::png},
                                          {"\xff\xd8\xff", Kind::jpeg}}};
constexpr std::size_t LONGEST_MAGIC = 8;

Kind kind_of(const std::string& bytes) {
    for (const Magic& magic : MAGICS) {
        if (bytes.starts_with(magic.bytes)) return magic.kind;
    }
    const bool pfm = bytes.size() > 2 && (bytes.starts_with("PF") || bytes.starts_with("Pf"));
    return pfm && std::string_view(" \t\r\n").find(bytes[2]) != std::string_view::npos ? Kind::pfm : Kind::other;
}

/// Refuses what cannot be an image at all: nothing, a folder, a pipe, an empty or unreadable file.
std::string first_bytes(const fs::path& file) {
    std::error_code error;
    const fs::file_status status = fs::status(file, error);
    if (status.type() == fs::file_type::not_found) throw refused(file, "no such file; check the path");
    if (error) throw refused(file, fmt::format("cannot be opened: {}; check the path", error.message()));
    if (fs::is_directory(status)) throw refused(file, "is a folder; name an image file");
    if (!fs::is_regular_file(status)) throw refused(file, "is not a regular file; save the image to a file first");
    std::ifstream in(file, std::ios::binary);
    if (!in)
        throw refused(
            file, fmt::format("cannot be opened: {}; check its permissions", std::generic_category().message(errno)));
    std::string bytes(LONGEST_MAGIC, '\0');
    in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(static_cast<std::size_t>(in.gcount()));
    if (bytes.empty()) throw refused(file, "is empty; get the file anew");
    return bytes;
}

/// PFM and Radiance files hold one picture and no layers.
void check_no_layers(const fs::path& file, const ReadOptions& options) {
    if (!options.layer.empty()) throw refused(file, "has no layers; --layer is for EXR files");
    if (options.part.value_or(0) != 0) throw refused(file, fmt::format("has no part {}, only part 0", *options.part));
}

std::unique_ptr<ImageSource> open_source(const fs::path& file, const ReadOptions& options) {
    const Kind kind = kind_of(first_bytes(file));
    if (kind == Kind::exr) return open_exr(file, options);
    if (suffix_of(file) == ".exr") {
        throw refused(file, "is not an EXR file, whatever its name says; its first bytes belong to another kind");
    }
    switch (kind) {
        case Kind::tiff:
            return open_oiio(file, oiio_abi::FORMAT_TIFF, options);
        case Kind::png:
            return open_oiio(file, oiio_abi::FORMAT_PNG, options);
        case Kind::jpeg:
            return open_oiio(file, oiio_abi::FORMAT_JPEG, options);
        case Kind::other:
            throw refused(file,
                          "is of no kind that is read, by its first bytes: EXR, Radiance HDR, PFM, TIFF, PNG and JPEG "
                          "are; convert it to one of these");
        default:
            break;
    }
    check_no_layers(file, options);
    return kind == Kind::pfm ? open_pfm(file, options) : open_radiance(file, options);
}

/// A source that can be a latitude-longitude map.
std::unique_ptr<ImageSource> open_map(const fs::path& file, const ReadOptions& options) {
    std::unique_ptr<ImageSource> source = open_source(file, options);
    if (source->is_cube()) {
        throw refused(file,
                      "is a cube map (its envmap attribute says so), not latitude-longitude; convert it with "
                      "exrenvmap -latlong");
    }
    return source;
}

/// What a map's file is, with what its shape tells.
MapSource source_of_map(const ImageSource& source) {
    MapSource described = source.described();
    if (source.width() != 2 * source.height()) {
        described.notes.push_back({"not_2_to_1", fmt::format("is {} x {}, not twice as wide as high; it is spread over "
                                                             "the whole sphere all the same",
                                                             source.width(), source.height())});
    }
    return described;
}

/// Refuses before it is taken what the limits or the machine do not have.
void check_memory(const fs::path& file, const ImageSource& source, std::size_t bytes_per_texel,
                  const ReadLimits& limits) {
    const std::size_t needed = source.width() * source.height() * bytes_per_texel;
    const std::size_t available = limits.max_bytes ? limits.max_bytes : available_memory();
    if (needed <= available) return;
    throw refused(
        file,
        fmt::format("{} x {} texels need {} of memory and {} {}; use a smaller image or free some memory",
                    source.width(), source.height(), format_bytes(static_cast<double>(needed)),
                    format_bytes(static_cast<double>(available)), limits.max_bytes ? "are allowed" : "are available"));
}

/// Rows of a band: a multiple of the file's own blocks.
std::size_t band_rows(const ImageSource& source) {
    const std::size_t blocks = BAND_TEXELS / source.width() / source.chunk_rows();
    return std::max(blocks, BAND_BLOCKS) * source.chunk_rows();
}

/// Hands bands from the thread that decodes to the one that uses them; the decoder never waits.
class BandQueue {
  public:
    struct Band {
        std::size_t begin = 0;
        std::size_t end = 0;
    };

    void push(Band band) {
        const std::lock_guard lock(mutex_);
        bands_.push_back(band);
        changed_.notify_one();
    }
    void finish(std::exception_ptr failure) {
        const std::lock_guard lock(mutex_);
        failure_ = std::move(failure);
        finished_ = true;
        changed_.notify_one();
    }
    /// The next band; false when there is none left. Rethrows what the decoder failed with.
    bool pop(Band& band) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return finished_ || !bands_.empty(); });
        if (failure_) std::rethrow_exception(failure_);
        if (bands_.empty()) return false;
        band = bands_.front();
        bands_.pop_front();
        return true;
    }

  private:
    std::mutex mutex_;
    std::condition_variable changed_;
    std::deque<Band> bands_;
    std::exception_ptr failure_;
    bool finished_ = false;
};

/// Rows [begin, end) as a map has them; the count is that of RadianceMap::ringing.
std::size_t read_map_rows(ImageSource& source, std::size_t begin, std::size_t end, Rows rgb) {
    source.read_rows(begin, end, rgb, {});
    if (!source.rings()) return 0;
    std::size_t count = 0;
    for (std::size_t r = begin; r < end; ++r) {
        float* row = rgb.row(r);
        for (std::size_t i = 0; i < 3 * source.width(); ++i) {
            count += row[i] < 0.0F;
            row[i] = row[i] < 0.0F ? 0.0F : row[i];  // NaN stays
        }
    }
    return count;
}

/// Decodes band after band in a thread of its own, while `use` works on the rows that are done in this one; the count
/// is that of RadianceMap::ringing.
template <class Use>
std::size_t read_overlapped(ImageSource& source, Rows rgb, std::size_t rows, Use use) {
    std::size_t ringing = 0;
    BandQueue queue;
    std::jthread decoder([&](const std::stop_token& stop) {
        try {
            for (std::size_t begin = 0; begin < source.height() && !stop.stop_requested(); begin += rows) {
                const std::size_t end = std::min(begin + rows, source.height());
                ringing += read_map_rows(source, begin, end, rgb);
                queue.push({begin, end});
            }
            queue.finish(nullptr);
        } catch (...) {
            queue.finish(std::current_exception());
        }
    });
    for (BandQueue::Band band; queue.pop(band);) use(band.begin, band.end);
    decoder.join();
    return ringing;
}

}  // namespace

void PageBuffer::Free::operator()(float* p) const noexcept { std::free(p); }

PageBuffer::PageBuffer(std::size_t count) : count_(count) {
    if (count == 0) return;
    if (count > (std::size_t{1} << 60)) throw std::bad_alloc();
    data_.reset(static_cast<float*>(take_pages(count * sizeof(float))));
}

InputError refused(const fs::path& file, std::string_view what) {
    return InputError(fmt::format("{}: {}", file.string(), what));
}

InputError damaged(const fs::path& file, std::string_view how) {
    return refused(file, fmt::format("damaged or cut short ({}); get the file anew", how));
}

bool is_exr(const fs::path& file) { return kind_of(first_bytes(file)) == Kind::exr; }

void check_size(const fs::path& file, std::size_t width, std::size_t height, const ReadLimits& limits) {
    if (width == 0 || height == 0)
        throw refused(file, fmt::format("has no texels ({} x {}); get the file anew", width, height));
    if (width > limits.max_side || height > limits.max_side || width > limits.max_texels / height) {
        throw refused(file, fmt::format("claims {} x {} texels, beyond the limits of {} a side and {} in all; "
                                        "make it smaller if it really is that large",
                                        width, height, limits.max_side, limits.max_texels));
    }
}

RadianceMap read_map(const fs::path& file, const ReadOptions& options) {
    const std::unique_ptr<ImageSource> source = open_map(file, options);
    check_memory(file, *source, 3 * sizeof(float), options.limits);
    const std::size_t width = source->width();
    const std::size_t height = source->height();
    RadianceMap map{width, height, PageBuffer(3 * width * height), 0, source_of_map(*source)};
    Rows rgb{map.rgb.data(), static_cast<std::ptrdiff_t>(3 * width)};
    if (options.flip_y) rgb = {rgb.row(height - 1), -rgb.stride};

    const auto ready = [&](std::size_t begin, std::size_t end) {
        if (!options.rows_ready) return;
        if (options.flip_y) {
            options.rows_ready(map, height - end, height - begin);
        } else {
            options.rows_ready(map, begin, end);
        }
    };
    const std::size_t rows = band_rows(*source);
    if (options.rows_ready && rows < height) {
        map.ringing = read_overlapped(*source, rgb, rows, ready);
    } else {
        map.ringing = read_map_rows(*source, 0, height, rgb);
        ready(0, height);
    }
    return map;
}

std::pair<std::size_t, std::size_t> read_image_size(const fs::path& file, const ReadOptions& options) {
    const std::unique_ptr<ImageSource> source = open_map(file, options);
    return {source->width(), source->height()};
}

Picture read_picture(const fs::path& file, const ReadOptions& options) {
    const std::unique_ptr<ImageSource> source = open_source(file, options);
    const std::size_t floats = source->has_alpha() ? 4 : 3;
    check_memory(file, *source, floats * sizeof(float), options.limits);
    Picture picture{source->width(), source->height(), {}, {}, source->described()};
    const std::size_t texels = picture.width * picture.height;
    picture.rgb.resize(3 * texels);
    Rows rgb{picture.rgb.data(), static_cast<std::ptrdiff_t>(3 * picture.width)};
    Rows alpha;
    if (source->has_alpha()) {
        picture.alpha.resize(texels);
        alpha = {picture.alpha.data(), static_cast<std::ptrdiff_t>(picture.width)};
    }
    if (options.flip_y) {
        rgb = {rgb.row(picture.height - 1), -rgb.stride};
        if (alpha.first) alpha = {alpha.row(picture.height - 1), -alpha.stride};
    }
    source->read_rows(0, picture.height, rgb, alpha);
    return picture;
}

}  // namespace clerestory
