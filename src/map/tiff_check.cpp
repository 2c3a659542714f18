#include <fmt/format.h>
#include <tiffio.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstddef>
#include <string>
#include <vector>

#include "map/file_check.hpp"

namespace clerestory::file_check {
namespace {

/// A compression that is read, and how many bytes one byte can stand for at most.
struct Compression {
    std::uint16_t tag;
    double most;
    /// Whether libtiff's warnings while it decodes are of damage: libjpeg's are, and runs that leave their strip.
    bool warns_of_damage;
};

/// LZW: codes of 9 bits and more stand for strings of up to 4096 bytes. PackBits: two bytes for a run of 128. Deflate:
/// two bits for a run of 258 (zlib.net/zlib_tech.html). JPEG: see jpeg_check.cpp. Zstandard: four bytes for a block
/// of 128 KiB (RFC 8878, 3.1.1.2). LZMA: the best of its range coder's probabilities, 2017/2048, in the eleven or more
/// decisions of a match of 273 bytes. Others are refused: none is used for maps, and most have no such bound.
constexpr std::array<Compression, 8> COMPRESSIONS = {{{COMPRESSION_NONE, 1, false},
                                                      {COMPRESSION_LZW, 4096, false},
                                                      {COMPRESSION_PACKBITS, 64, true},
                                                      {COMPRESSION_ADOBE_DEFLATE, 1032, false},
                                                      {COMPRESSION_DEFLATE, 1032, false},
                                                      {COMPRESSION_JPEG, 2048, true},
                                                      {COMPRESSION_ZSTD, 32768, false},
                                                      {COMPRESSION_LZMA, 9216, false}}};

/// Tiles may be larger than a small picture, but not absurdly so.
constexpr std::uint32_t USUAL_TILE_SIDE = 2048;

/// What libtiff said last about a file. Its handlers are per file, so that files can be read in several threads.
struct Complaints {
    std::string error;
    std::string warning;
    bool is_cut = false;  ///< a part of the directory lies behind the file's end; libtiff then goes on without it
};

std::string formatted(const char* format, va_list arguments) {
    std::array<char, 512> text{};
    std::vsnprintf(text.data(), text.size(), format, arguments);
    return text.data();
}

extern "C" {
static int tiff_failed(TIFF*, void* complaints, const char*, const char* format, va_list arguments) {
    static_cast<Complaints*>(complaints)->error = formatted(format, arguments);
    return 1;
}
static int tiff_warned(TIFF*, void* user, const char*, const char* format, va_list arguments) {
    auto* complaints = static_cast<Complaints*>(user);
    complaints->warning = formatted(format, arguments);
    if (complaints->warning.find("IO error") != std::string::npos) complaints->is_cut = true;
    return 1;
}
}

struct CloseTiff {
    void operator()(TIFF* tiff) const noexcept { TIFFClose(tiff); }
};

template <class T>
T tag(TIFF* tiff, std::uint32_t number, T otherwise) {
    T value = otherwise;
    return TIFFGetFieldDefaulted(tiff, number, &value) ? value : otherwise;
}

const Compression& compression_of(TIFF* tiff) {
    const auto number = tag<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
    const auto* known =
        std::find_if(COMPRESSIONS.begin(), COMPRESSIONS.end(), [&](const Compression& c) { return c.tag == number; });
    if (known != COMPRESSIONS.end() && TIFFIsCODECConfigured(number)) return *known;
    throw Refusal(fmt::format(
        "is compressed in a way that is not read here (TIFF's number {}); write it with deflate, LZW or none", number));
}

/// Inflates all of a block and looks at the checksum behind it: damage mostly gives more bytes than are wanted, and
/// libtiff stops where it has enough of them.
bool is_whole_deflate(std::vector<unsigned char>& stored, std::uint64_t least_bytes) {
    z_stream stream{};
    if (inflateInit(&stream) != Z_OK) return false;
    std::array<unsigned char, 1 << 16> scratch{};
    stream.next_in = stored.data();
    stream.avail_in = static_cast<uInt>(stored.size());
    int status = Z_OK;
    while (status == Z_OK) {
        stream.next_out = scratch.data();
        stream.avail_out = static_cast<uInt>(scratch.size());
        status = inflate(&stream, Z_NO_FLUSH);
    }
    const std::uint64_t bytes = stream.total_out;
    inflateEnd(&stream);
    return status == Z_STREAM_END && bytes >= least_bytes;
}

/// One page. Its texels come in blocks: strips, which end with the picture, or tiles, which do not.
class TiffCheck final : public FileCheck {
  public:
    explicit TiffCheck(const char* file) {
        open_file(file, length_);
        open(file);
        // A page that is missing may have been the picture, and the first a small copy of it.
        while (!said_.is_cut && !TIFFLastDirectory(tiff_.get())) {
            if (!TIFFReadDirectory(tiff_.get())) fail();
        }
        if (said_.is_cut) fail();
    }

    void check_page(int page) override {
        if (!TIFFSetDirectory(tiff_.get(), static_cast<tdir_t>(page))) fail();
        compression_ = &compression_of(tiff_.get());
        check_colours();
        is_tiled_ = TIFFIsTiled(tiff_.get()) != 0;
        width_ = tag<std::uint32_t>(tiff_.get(), TIFFTAG_IMAGEWIDTH, 0);
        height_ = tag<std::uint32_t>(tiff_.get(), TIFFTAG_IMAGELENGTH, 0);
        if (width_ == 0 || height_ == 0) throw Damage("it has no texels");
        if (is_tiled_) check_tile_size();
        check_size();
        blocks_ = is_tiled_ ? TIFFNumberOfTiles(tiff_.get()) : TIFFNumberOfStrips(tiff_.get());
        for (std::uint32_t block = 0; block < blocks_; ++block) check_place(block);
    }

    void check_texels() override {
        std::vector<unsigned char> texels(compression_->most > 1 ? block_bytes(0) : 0);
        std::vector<unsigned char> stored;
        for (std::uint32_t block = 0; block < blocks_; ++block) {
            if (is_deflate()) check_deflate(block, stored);
            if (!texels.empty()) decode(block, texels);
        }
    }

  private:
    [[noreturn]] void fail() const { throw Damage("libtiff: " + (said_.error.empty() ? said_.warning : said_.error)); }

    void open(const char* file) {
        const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> how(TIFFOpenOptionsAlloc(),
                                                                                   TIFFOpenOptionsFree);
        TIFFOpenOptionsSetErrorHandlerExtR(how.get(), tiff_failed, &said_);
        TIFFOpenOptionsSetWarningHandlerExtR(how.get(), tiff_warned, &said_);
        // What libtiff itself takes, such as tables of strips, comes from the file: eight bytes for one at most.
        constexpr std::uint64_t SMALL = std::uint64_t{1} << 26;
        TIFFOpenOptionsSetMaxSingleMemAlloc(how.get(), static_cast<tmsize_t>(SMALL + 8 * length_));
        // m: not mapped, so that a file that is cut while it is read ends in an error and not in a signal.
        tiff_.reset(TIFFOpenExt(file, "rm", how.get()));
        if (!tiff_) fail();
    }

    /// OpenImageIO gives luminance and chroma, Lab and inks as they are stored, or as colours that nobody measured.
    void check_colours() const {
        const auto colours = tag<std::uint16_t>(tiff_.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_RGB);
        const bool decoded = colours == PHOTOMETRIC_YCBCR && compression_->tag == COMPRESSION_JPEG;
        if (decoded || colours <= PHOTOMETRIC_PALETTE) return;
        throw Refusal(
            fmt::format("has no R, G, B and not one grey channel alone, but inks or another colour space (TIFF's "
                        "number {}); write it as RGB",
                        colours));
    }

    void check_tile_size() const {
        const auto tile_width = tag<std::uint32_t>(tiff_.get(), TIFFTAG_TILEWIDTH, 0);
        const auto tile_height = tag<std::uint32_t>(tiff_.get(), TIFFTAG_TILELENGTH, 0);
        const auto most = [](std::uint32_t side) { return std::max(side, USUAL_TILE_SIDE - 15) + std::uint64_t{15}; };
        if (tile_width == 0 || tile_height == 0) throw Damage("its tiles have no size");
        if (tile_width <= most(width_) && tile_height <= most(height_)) return;
        throw Damage(fmt::format("its tiles are {} x {} texels for a picture of {} x {}", tile_width, tile_height,
                                 width_, height_));
    }

    /// Before libtiff is asked how many blocks there are: that too may be any number.
    void check_size() const {
        const auto bits = tag<std::uint16_t>(tiff_.get(), TIFFTAG_BITSPERSAMPLE, 1);
        const auto samples = tag<std::uint16_t>(tiff_.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
        // Where chroma has a lower resolution, libtiff's JPEG gives half of the samples at least.
        const bool is_jpeg = compression_->tag == COMPRESSION_JPEG;
        const double decoded = 1.0 * width_ * height_ * samples * bits / 8 / (is_jpeg ? 2 : 1);
        check_claim(width_, height_, decoded, compression_->most, length_);
    }

    /// Decoded bytes of a block; strips of one plane follow one another.
    [[nodiscard]] std::uint64_t block_bytes(std::uint32_t block) const {
        if (is_tiled_) return TIFFTileSize64(tiff_.get());
        const std::uint32_t rows = std::min(tag<std::uint32_t>(tiff_.get(), TIFFTAG_ROWSPERSTRIP, height_), height_);
        const std::uint32_t first = block % ((height_ - 1) / rows + 1) * rows;
        return TIFFVStripSize64(tiff_.get(), std::min(rows, height_ - first));
    }

    void check_place(std::uint32_t block) const {
        const char* what = is_tiled_ ? "tile" : "strip";
        int failed = 0;
        const std::uint64_t at = TIFFGetStrileOffsetWithErr(tiff_.get(), block, &failed);
        const std::uint64_t bytes = failed ? 0 : TIFFGetStrileByteCountWithErr(tiff_.get(), block, &failed);
        if (failed || at == 0 || bytes == 0) throw Damage(fmt::format("{} {} is missing", what, block));
        if (bytes > length_ || at > length_ - bytes) {
            throw Damage(fmt::format("{} {} ends at byte {} of {}", what, block,
                                     static_cast<double>(at) + static_cast<double>(bytes), length_));
        }
        const std::uint64_t decoded = block_bytes(block);
        if (static_cast<double>(decoded) <= compression_->most * static_cast<double>(bytes)) return;
        throw Damage(fmt::format("{} {} has {} bytes for {}", what, block, bytes, decoded));
    }

    [[nodiscard]] bool is_deflate() const {
        return compression_->tag == COMPRESSION_ADOBE_DEFLATE || compression_->tag == COMPRESSION_DEFLATE;
    }

    void check_deflate(std::uint32_t block, std::vector<unsigned char>& stored) {
        stored.resize(TIFFGetStrileByteCount(tiff_.get(), block));
        const auto size = static_cast<tmsize_t>(stored.size());
        const tmsize_t read = is_tiled_ ? TIFFReadRawTile(tiff_.get(), block, stored.data(), size)
                                        : TIFFReadRawStrip(tiff_.get(), block, stored.data(), size);
        if (read != size) fail();
        if (tag<std::uint16_t>(tiff_.get(), TIFFTAG_FILLORDER, FILLORDER_MSB2LSB) == FILLORDER_LSB2MSB)
            TIFFReverseBits(stored.data(), size);
        if (!is_whole_deflate(stored, block_bytes(block)))
            throw Damage(fmt::format("block {} does not fit its Deflate checksum", block));
    }

    void decode(std::uint32_t block, std::vector<unsigned char>& texels) {
        said_ = {};
        const auto size = static_cast<tmsize_t>(block_bytes(block));
        const tmsize_t read = is_tiled_ ? TIFFReadEncodedTile(tiff_.get(), block, texels.data(), size)
                                        : TIFFReadEncodedStrip(tiff_.get(), block, texels.data(), size);
        if (!said_.error.empty() || (compression_->warns_of_damage && !said_.warning.empty())) fail();
        if (read != size) throw Damage(fmt::format("block {} has {} bytes in place of {}", block, read, size));
    }

    std::uint64_t length_ = 0;
    Complaints said_;  ///< outlives tiff_, whose handlers write to it
    std::unique_ptr<TIFF, CloseTiff> tiff_;
    const Compression* compression_ = nullptr;
    bool is_tiled_ = false;
    std::uint32_t width_ = 0;
    std::uint32_t height_ = 0;
    std::uint32_t blocks_ = 0;
};

}  // namespace

std::unique_ptr<FileCheck> check_tiff(const char* file) { return std::make_unique<TiffCheck>(file); }

}  // namespace clerestory::file_check
