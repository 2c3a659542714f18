#include <fmt/format.h>
// jpeglib.h wants this before it.
#include <cstdio>

#include <jerror.h>
#include <jpeglib.h>

#include <csetjmp>
#include <cstddef>
#include <vector>

#include "map/file_check.hpp"

namespace clerestory::file_check {
namespace {

/// Samples that one byte can stand for at most: a block of 8 x 8 takes one bit at least in a Huffman code, and is
/// spread over 32 x 32 texels where chroma has a quarter of the resolution each way. For three components, one of which
/// has the full resolution, that is 1366 (ITU T.81, A.1.1, A.2 and G.1.2).
constexpr double MOST_SAMPLES = 2048;
/// A progressive picture needs a few dozen; each costs a pass over the whole picture, however small it is itself.
constexpr int MOST_SCANS = 500;

struct JpegErrors {
    jpeg_error_mgr manager;  // first, so that libjpeg's pointer to it is one to the whole
    std::jmp_buf back;
    char message[JMSG_LENGTH_MAX];
};

// libjpeg is C: nothing may be thrown through it, so its errors come back by longjmp, into functions that hold nothing.
extern "C" {
static void jpeg_failed(j_common_ptr jpeg) {
    auto* errors = reinterpret_cast<JpegErrors*>(jpeg->err);
    jpeg->err->format_message(jpeg, errors->message);
    std::longjmp(errors->back, 1);
}
/// libjpeg goes on after damage, with grey or with what it had: here that is the end. Two warnings are of odd headers.
static void jpeg_warned(j_common_ptr jpeg, int level) {
    const int code = jpeg->err->msg_code;
    if (level < 0 && code != JWRN_ADOBE_XFORM && code != JWRN_JFIF_MAJOR) jpeg_failed(jpeg);
}
static void jpeg_printed(j_common_ptr) {}
static void jpeg_progressed(j_common_ptr jpeg) {
    auto* decompress = reinterpret_cast<j_decompress_ptr>(jpeg);
    if (decompress->input_scan_number > MOST_SCANS) ERREXIT(jpeg, JERR_BAD_PROGRESSION);
}
}

/// Reads the header. False with the message set where libjpeg fails.
bool read_jpeg_header(jpeg_decompress_struct& jpeg, JpegErrors& errors, std::FILE* file) {
    if (setjmp(errors.back)) return false;
    jpeg_create_decompress(&jpeg);
    jpeg_stdio_src(&jpeg, file);
    jpeg_read_header(&jpeg, TRUE);
    return true;
}

/// All rows, into the same place, and what follows them to the end marker. False as above.
bool read_jpeg_rows(jpeg_decompress_struct& jpeg, JpegErrors& errors, unsigned char* row) {
    if (setjmp(errors.back)) return false;
    jpeg.out_color_space = jpeg.jpeg_color_space;  // as it is stored: nothing is converted for nobody
    jpeg_start_decompress(&jpeg);
    while (jpeg.output_scanline < jpeg.output_height) jpeg_read_scanlines(&jpeg, &row, 1);
    jpeg_finish_decompress(&jpeg);
    return true;
}

/// libjpeg's state, which goes whatever happens.
struct JpegState {
    JpegState() = default;
    JpegState(const JpegState&) = delete;
    JpegState& operator=(const JpegState&) = delete;
    ~JpegState() { jpeg_destroy_decompress(&jpeg); }

    JpegErrors errors{};
    jpeg_decompress_struct jpeg{};
    jpeg_progress_mgr progress{};
};

class JpegCheck final : public FileCheck {
  public:
    explicit JpegCheck(const char* file) : file_(open_file(file, length_)) {
        jpeg_decompress_struct& jpeg = state_.jpeg;
        jpeg.err = jpeg_std_error(&state_.errors.manager);
        state_.errors.manager.error_exit = jpeg_failed;
        state_.errors.manager.emit_message = jpeg_warned;
        state_.errors.manager.output_message = jpeg_printed;
        if (!read_jpeg_header(jpeg, state_.errors, file_.get())) fail();
        state_.progress.progress_monitor = jpeg_progressed;
        jpeg.progress = &state_.progress;
        if (jpeg.num_components != 1 && jpeg.num_components != 3) {
            throw Refusal(
                fmt::format("has no R, G, B and not one grey channel alone, but {} components, such as inks; write "
                            "it as RGB",
                            jpeg.num_components));
        }
        const double decoded = 1.0 * jpeg.image_width * jpeg.image_height * jpeg.num_components;
        check_claim(jpeg.image_width, jpeg.image_height, decoded, MOST_SAMPLES, length_);
    }

    void check_texels() override {
        const jpeg_decompress_struct& jpeg = state_.jpeg;
        std::vector<unsigned char> row(std::size_t{jpeg.image_width} * static_cast<std::size_t>(jpeg.num_components));
        if (!read_jpeg_rows(state_.jpeg, state_.errors, row.data())) fail();
    }

  private:
    [[noreturn]] void fail() const { throw Damage(fmt::format("libjpeg: {}", state_.errors.message)); }

    std::uint64_t length_ = 0;
    File file_;
    JpegState state_;
};

}  // namespace

std::unique_ptr<FileCheck> check_jpeg(const char* file) { return std::make_unique<JpegCheck>(file); }

}  // namespace clerestory::file_check
