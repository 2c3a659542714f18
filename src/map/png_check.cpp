#include <png.h>

#include <csetjmp>
#include <cstddef>
#include <string>
#include <vector>

#include "map/file_check.hpp"

namespace clerestory::file_check {
namespace {

/// Bytes that one byte of deflate can stand for at most: two bits for a run of 258 (zlib.net/zlib_tech.html).
constexpr double MOST_INFLATED = 1032;

// libpng is C: nothing may be thrown through it, so its errors come back by longjmp, into functions that hold nothing.
extern "C" {
static void png_check_failed(png_structp png, png_const_charp message) {
    *static_cast<std::string*>(png_get_error_ptr(png)) = message;
    png_longjmp(png, 1);
}
static void png_check_warned(png_structp, png_const_charp) {}
}

/// Reads up to the first texels' chunk. False with the message set where libpng fails.
bool read_png_header(png_structp png, png_infop info, std::FILE* file) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_init_io(png, file);
    // A damaged chunk of any kind: one that is passed over may be the one that says how values are encoded.
    png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
    png_set_user_limits(png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);  // the program's own limits come after
    png_read_info(png, info);
    return true;
}

/// All rows, into the same place, and what follows them to the file's end. False as above.
bool read_png_rows(png_structp png, png_infop info, std::vector<unsigned char>& row) {
    if (setjmp(png_jmpbuf(png))) return false;
    const int passes = png_set_interlace_handling(png);
    png_read_update_info(png, info);
    row.resize(png_get_rowbytes(png, info));
    for (int pass = 0; pass < passes; ++pass) {
        for (png_uint_32 y = 0; y < png_get_image_height(png, info); ++y) png_read_row(png, row.data(), nullptr);
    }
    png_read_end(png, nullptr);
    return true;
}

/// libpng's state, which goes whatever happens.
struct PngState {
    PngState() : png(png_create_read_struct(PNG_LIBPNG_VER_STRING, &message, png_check_failed, png_check_warned)) {
        if (png) info = png_create_info_struct(png);
    }
    PngState(const PngState&) = delete;
    PngState& operator=(const PngState&) = delete;
    ~PngState() { png_destroy_read_struct(&png, &info, nullptr); }

    std::string message = "out of memory";
    png_structp png;
    png_infop info = nullptr;
};

class PngCheck final : public FileCheck {
  public:
    explicit PngCheck(const char* file) : file_(open_file(file, length_)) {
        if (!state_.info || !read_png_header(state_.png, state_.info, file_.get())) fail();
        const std::uint64_t width = png_get_image_width(state_.png, state_.info);
        const std::uint64_t height = png_get_image_height(state_.png, state_.info);
        const auto row_bytes = static_cast<double>(png_get_rowbytes(state_.png, state_.info));
        check_claim(width, height, row_bytes * static_cast<double>(height), MOST_INFLATED, length_);
    }

    void check_texels() override {
        std::vector<unsigned char> row;
        if (!read_png_rows(state_.png, state_.info, row)) fail();
    }

  private:
    [[noreturn]] void fail() const { throw Damage("libpng: " + state_.message); }

    std::uint64_t length_ = 0;
    File file_;
    PngState state_;
};

}  // namespace

std::unique_ptr<FileCheck> check_png(const char* file) { return std::make_unique<PngCheck>(file); }

}  // namespace clerestory::file_check
