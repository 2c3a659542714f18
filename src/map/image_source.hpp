#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string_view>
#include <utility>

#include "error.hpp"
#include "image.hpp"
#include "map/oiio_abi.hpp"

namespace clerestory {

/// Where decoded rows go: row r of the file begins at first + r * stride (floats). A negative stride turns the image
/// over.
struct Rows {
    float* first = nullptr;
    std::ptrdiff_t stride = 0;
    [[nodiscard]] float* row(std::size_t r) const { return first + static_cast<std::ptrdiff_t>(r) * stride; }
};

/// An opened image file whose size is known and within the limits, and whose pixels have not been read yet.
class ImageSource {
  public:
    ImageSource(std::size_t width, std::size_t height, std::size_t chunk_rows, bool has_alpha, MapSource described)
        : width_(width),
          height_(height),
          chunk_rows_(chunk_rows),
          has_alpha_(has_alpha),
          described_(std::move(described)) {}
    ImageSource(const ImageSource&) = delete;
    ImageSource& operator=(const ImageSource&) = delete;
    virtual ~ImageSource() = default;

    [[nodiscard]] std::size_t width() const noexcept { return width_; }
    [[nodiscard]] std::size_t height() const noexcept { return height_; }
    /// Rows that are decoded together: reading is cheapest, and sometimes only possible, in multiples of it.
    [[nodiscard]] std::size_t chunk_rows() const noexcept { return chunk_rows_; }
    [[nodiscard]] bool has_alpha() const noexcept { return has_alpha_; }

    /// What of the file is read, and what is to be said about it.
    [[nodiscard]] const MapSource& described() const noexcept { return described_; }

    /// Whether the file says that it is a cube map: no latitude-longitude map, whatever its size.
    [[nodiscard]] bool is_cube() const noexcept { return is_cube_; }
    void mark_cube() noexcept { is_cube_ = true; }

    /// Whether the file's compression leaves small negative values beside bright ones.
    [[nodiscard]] virtual bool rings() const noexcept { return false; }

    /// Decodes rows [begin, end) to `rgb` (3 floats a texel) and, unless its `first` is null, `alpha` (1 float).
    /// begin is a multiple of chunk_rows(), end too or the height. Throws InputError.
    virtual void read_rows(std::size_t begin, std::size_t end, Rows rgb, Rows alpha) = 0;

  private:
    std::size_t width_;
    std::size_t height_;
    std::size_t chunk_rows_;
    bool has_alpha_;
    bool is_cube_ = false;
    MapSource described_;
};

/// What is wrong with a file, after its name; and the same where its bytes break its format's rules.
InputError refused(const std::filesystem::path& file, std::string_view what);
InputError damaged(const std::filesystem::path& file, std::string_view how);

/// Whether a file is EXR by its first bytes. Refuses what cannot be an image at all: nothing, a folder, a pipe, an
/// empty or unreadable file. Throws InputError.
bool is_exr(const std::filesystem::path& file);

/// Width and height as read_map would find them, from the header alone. Throws InputError.
std::pair<std::size_t, std::size_t> read_image_size(const std::filesystem::path& file, const ReadOptions& options);

/// Refuses a claimed size that is empty or beyond `limits`. Throws InputError.
void check_size(const std::filesystem::path& file, std::size_t width, std::size_t height, const ReadLimits& limits);

/// Refuses an EXR file whose header names an attribute longer than the file: OpenEXR would take its memory before it
/// reads. Throws InputError.
void check_exr_attributes(const std::filesystem::path& file);

/// Each opens an image of one kind. Throws InputError.
std::unique_ptr<ImageSource> open_exr(const std::filesystem::path& file, const ReadOptions& options);
std::unique_ptr<ImageSource> open_pfm(const std::filesystem::path& file, const ReadOptions& options);
std::unique_ptr<ImageSource> open_radiance(const std::filesystem::path& file, const ReadOptions& options);

/// Opens an image through OpenImageIO, whose module is loaded on the first call. Throws InputError.
std::unique_ptr<ImageSource> open_oiio(const std::filesystem::path& file, oiio_abi::Format format,
                                       const ReadOptions& options);

}  // namespace clerestory
