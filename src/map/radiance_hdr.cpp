#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "base/text_escape.hpp"
#include "map/image_source.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// More than any header: programs of the Radiance suite add a line each.
constexpr std::size_t MOST_HEADER_BYTES = std::size_t{1} << 20;
constexpr std::size_t CODE_BYTES = 4;  ///< of a texel: three mantissas and their exponent
/// Widths that scanlines of the newer run-length coding can have.
constexpr std::size_t NARROWEST_CODED = 8;
constexpr std::size_t WIDEST_CODED = 0x7fff;

struct RadianceHeader {
    std::size_t width = 0;
    std::size_t height = 0;
    bool bottom_up = false;
    bool right_to_left = false;
    double exposure = 1;  ///< product of the EXPOSURE lines: what the values were multiplied by
    std::array<double, 3> correction = {1, 1, 1};  ///< product of the COLORCORR lines
    double gamma = 1;
    bool other_primaries = false;
    std::size_t size = 0;  ///< bytes before the first scanline
};

/// A header's numbers after the equals sign; those that can be read.
std::vector<double> numbers_of(std::string_view text) {
    std::istringstream in{std::string(text)};
    in.imbue(std::locale::classic());
    std::vector<double> numbers;
    for (double value = 0; in >> value;) numbers.push_back(value);
    return numbers;
}

/// Whether PRIMARIES names Rec. 709's, with the white of D65 or Radiance's own of equal energy.
bool is_rec709(const std::vector<double>& named) {
    constexpr double ROUNDING = 0.011;  // Radiance's own green is 0.29, 0.6
    constexpr std::array<double, 6> PRIMARIES = {0.64, 0.33, 0.3, 0.6, 0.15, 0.06};
    constexpr std::array<std::array<double, 2>, 2> WHITES = {{{0.3127, 0.329}, {1.0 / 3, 1.0 / 3}}};
    if (named.size() != 8) return false;
    const auto near = [](double a, double b) { return std::abs(a - b) <= ROUNDING; };
    return std::equal(PRIMARIES.begin(), PRIMARIES.end(), named.begin(), near) &&
           std::any_of(WHITES.begin(), WHITES.end(),
                       [&](const auto& white) { return near(white[0], named[6]) && near(white[1], named[7]); });
}

/// Source: G. Ward, "Radiance File Formats", section "Picture File Format".
class HeaderParser {
  public:
    HeaderParser(const fs::path& file, std::string_view text) : file_(file), text_(text) {}

    RadianceHeader parse() {
        next_line();  // the kind of program, after #?
        for (std::string_view line = next_line(); !line.empty(); line = next_line()) add_line(line);
        add_resolution(next_line());
        header_.size = at_;
        return header_;
    }

  private:
    /// Without its line end, whatever its length.
    std::string_view next_line() {
        const std::size_t end = text_.find('\n', at_);
        if (end == std::string_view::npos) throw damaged(file_, "its header does not end");
        std::string_view line = text_.substr(at_, end - at_);
        at_ = end + 1;
        if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
        return line;
    }

    void add_line(std::string_view line) {
        const std::size_t equals = line.find('=');
        if (line.front() == '#' || equals == std::string_view::npos) return;
        const std::string_view name = line.substr(0, equals);
        const std::string_view value = line.substr(equals + 1);
        const std::vector<double> numbers = numbers_of(value);
        if (name == "FORMAT") check_format(value);
        if (name == "PRIMARIES") header_.other_primaries = !is_rec709(numbers);
        if (name == "EXPOSURE" && !numbers.empty()) header_.exposure *= numbers.front();
        if (name == "GAMMA" && !numbers.empty()) header_.gamma *= numbers.front();
        if (name == "COLORCORR" && numbers.size() == 3) {
            for (std::size_t c = 0; c < 3; ++c) header_.correction[c] *= numbers[c];
        }
    }

    void check_format(std::string_view value) const {
        const std::size_t begin = std::min(value.find_first_not_of(' '), value.size());
        const std::string format = one_line(value.substr(begin, value.find_last_not_of(' ') + 1 - begin));
        if (format == "32-bit_rle_rgbe") return;
        if (format == "32-bit_rle_xyze") {
            throw refused(file_,
                          "holds CIE X, Y, Z (FORMAT=32-bit_rle_xyze), not R, G, B; convert it with Radiance's "
                          "ra_xyze -r");
        }
        throw refused(file_, fmt::format("has an unknown FORMAT={}; write it as 32-bit_rle_rgbe", format));
    }

    /// "-Y 512 +X 1024": rows from the top, texels from the left.
    void add_resolution(std::string_view line) {
        std::istringstream in{std::string(line)};
        in.imbue(std::locale::classic());
        std::array<std::string, 2> axes;
        std::array<std::int64_t, 2> sizes{};
        if (!(in >> axes[0] >> sizes[0] >> axes[1] >> sizes[1])) {
            throw damaged(file_, "its header names no size");
        }
        const auto is_axis = [](const std::string& axis, char name) {
            return axis.size() == 2 && (axis[0] == '-' || axis[0] == '+') && axis[1] == name;
        };
        if (is_axis(axes[0], 'X') && is_axis(axes[1], 'Y')) {
            throw refused(file_, "is stored column by column; turn it upright first, with Radiance's protate");
        }
        if (!is_axis(axes[0], 'Y') || !is_axis(axes[1], 'X')) throw damaged(file_, "its header names no size");
        header_.height = static_cast<std::size_t>(std::max<std::int64_t>(sizes[0], 0));
        header_.width = static_cast<std::size_t>(std::max<std::int64_t>(sizes[1], 0));
        header_.bottom_up = axes[0][0] == '+';
        header_.right_to_left = axes[1][0] == '-';
    }

    const fs::path& file_;
    std::string_view text_;
    std::size_t at_ = 0;
    RadianceHeader header_;
};

/// What a header says of the values that this program leaves as they stand.
std::vector<MapNote> notes_of(const RadianceHeader& header) {
    std::vector<MapNote> notes;
    if (header.exposure != 1) {
        // No scale undoes an exposure of 0.
        const double undoing = 1 / header.exposure;
        notes.push_back(
            {"exposure",
             fmt::format("its values were multiplied by {:g} (EXPOSURE), which stays in them{}", header.exposure,
                         std::isfinite(undoing) ? fmt::format("; --scale {:g} undoes it", undoing) : "")});
    }
    if (header.correction != std::array<double, 3>{1, 1, 1}) {
        notes.push_back(
            {"colour_correction", fmt::format("its R, G and B were multiplied by {:g} (COLORCORR), which stays in them",
                                              fmt::join(header.correction, ", "))});
    }
    if (header.gamma != 1) {
        notes.push_back({"gamma", fmt::format("names a GAMMA of {:g}; its values are taken as linear", header.gamma)});
    }
    if (header.other_primaries) {
        notes.push_back({"other_primaries", "its PRIMARIES are not Rec. 709's; R, G and B are taken as they stand"});
    }
    return notes;
}

/// The newer run-length coding begins each row with 2, 2 and the width; without it rows may have the older one.
bool has_coded_rows(const RadianceHeader& header, std::string_view data) {
    return header.width >= NARROWEST_CODED && header.width <= WIDEST_CODED && data.starts_with("\2\2");
}

/// Refuses a file that is too short for any picture of its size, before memory is taken for one.
void check_length(const fs::path& file, const RadianceHeader& header, bool coded) {
    constexpr std::size_t LONGEST_RUN = 127;
    const std::size_t runs = (header.width + LONGEST_RUN - 1) / LONGEST_RUN;
    const std::size_t shortest_row = CODE_BYTES + (coded ? CODE_BYTES * 2 * runs : 0);
    std::error_code error;
    const std::uintmax_t length = fs::file_size(file, error);
    if (error || length >= header.size + header.height * shortest_row) return;
    throw damaged(file, fmt::format("{} bytes cannot hold {} x {} texels", length, header.width, header.height));
}

///   coded  rows have the coding that other readers know
MapSource source_of(const RadianceHeader& header, bool coded) {
    MapSource source;
    source.format = "Radiance";
    source.compression = coded ? "rle" : "none or old rle";
    source.type = "rgbe";
    source.channels = {"R", "G", "B"};
    source.notes = notes_of(header);
    source.plain = coded && source.notes.empty() && !header.bottom_up && !header.right_to_left;
    return source;
}

/// Takes bytes of a file one after the other.
class Bytes {
  public:
    Bytes(const fs::path& file, std::ifstream in) : file_(file), in_(std::move(in)) {}

    std::uint8_t next() {
        if (at_ == buffer_.size()) fill();
        return buffer_[at_++];
    }
    /// Puts back the last `count` bytes that next() gave, at most CODE_BYTES.
    void back(std::size_t count) { at_ -= count; }
    void seek(std::size_t position) {
        in_.clear();
        in_.seekg(static_cast<std::streamoff>(position));
        buffer_.clear();
        at_ = 0;
    }

  private:
    void fill() {
        constexpr std::size_t BLOCK = std::size_t{1} << 16;
        // The last few bytes stay, for back().
        const std::size_t kept = std::min(buffer_.size(), CODE_BYTES);
        std::copy(buffer_.end() - static_cast<std::ptrdiff_t>(kept), buffer_.end(), buffer_.begin());
        buffer_.resize(kept + BLOCK);
        in_.read(reinterpret_cast<char*>(buffer_.data() + kept), static_cast<std::streamsize>(BLOCK));
        buffer_.resize(kept + static_cast<std::size_t>(in_.gcount()));
        at_ = kept;
        if (at_ == buffer_.size()) throw damaged(file_, "rows are missing");
    }

    const fs::path& file_;
    std::ifstream in_;
    std::vector<std::uint8_t> buffer_;
    std::size_t at_ = 0;
};

/// Radiance RGBE: run-length coded component by component, texel by texel as before 1991, or not at all.
class RadianceSource final : public ImageSource {
  public:
    RadianceSource(fs::path file, std::ifstream in, const RadianceHeader& header, bool coded)
        : ImageSource(header.width, header.height, 1, false, source_of(header, coded)),
          file_(std::move(file)),
          header_(header),
          bytes_(file_, std::move(in)) {
        rewind();
    }

    void read_rows(std::size_t begin, std::size_t end, Rows rgb, Rows /*alpha*/) override {
        // Rows lie one after the other with lengths of their own, from the bottom where the header says so.
        const std::size_t first = header_.bottom_up ? height() - end : begin;
        const std::size_t last = header_.bottom_up ? height() - begin : end;
        if (next_row_ > first) rewind();
        for (; next_row_ < last; ++next_row_) {
            decode_row();
            if (next_row_ >= first) store(rgb.row(header_.bottom_up ? height() - 1 - next_row_ : next_row_));
        }
    }

  private:
    using Code = std::array<std::uint8_t, CODE_BYTES>;

    void rewind() {
        bytes_.seek(header_.size);
        row_.assign(width(), Code{});
        next_row_ = 0;
    }

    Code next_code() {
        Code code;
        for (auto& byte : code) byte = bytes_.next();
        return code;
    }

    void decode_row() {
        if (width() < NARROWEST_CODED || width() > WIDEST_CODED) return decode_texels();
        const Code mark = next_code();
        if (mark[0] != 2 || mark[1] != 2 || mark[2] >= 0x80) {
            bytes_.back(CODE_BYTES);
            return decode_texels();
        }
        if ((std::size_t{mark[2]} << 8U | mark[3]) != width()) {
            throw damaged(file_, "a row has another width than the picture");
        }
        for (std::size_t c = 0; c < CODE_BYTES; ++c) decode_component(c);
    }

    /// Counts to 128 are followed by as many bytes; larger ones, less 128, by one byte that is repeated.
    void decode_component(std::size_t c) {
        constexpr std::size_t RUN = 128;
        for (std::size_t x = 0; x < width();) {
            std::size_t count = bytes_.next();
            const bool run = count > RUN;
            if (run) count -= RUN;
            if (count == 0 || count > width() - x) throw damaged(file_, "a run leaves its row");
            const std::uint8_t repeated = run ? bytes_.next() : std::uint8_t{0};
            for (const std::size_t end = x + count; x < end; ++x) row_[x][c] = run ? repeated : bytes_.next();
        }
    }

    /// Texel by texel; mantissas of 1, 1, 1 repeat the texel before as often as the exponent's byte says, and one after
    /// another such mark counts in higher digits.
    void decode_texels() {
        unsigned shift = 0;
        for (std::size_t x = 0; x < width();) {
            const Code code = next_code();
            if (code[0] != 1 || code[1] != 1 || code[2] != 1) {
                row_[x++] = code;
                shift = 0;
                continue;
            }
            const std::size_t count = shift < 32 ? std::size_t{code[3]} << shift : 0;
            if (x == 0 || count > width() - x) throw damaged(file_, "a run leaves its row");
            std::fill_n(row_.begin() + static_cast<std::ptrdiff_t>(x), count, row_[x - 1]);
            x += count;
            shift += 8;
        }
    }

    /// What a mantissa of 1 is worth beside each exponent; an exponent of 0 is black.
    static std::array<float, 256> units_of_exponents() {
        constexpr int BIAS = 128 + 8;  // of the exponent, and of mantissas as whole numbers
        std::array<float, 256> units{};
        for (std::size_t e = 1; e < units.size(); ++e) units[e] = std::ldexp(1.0F, static_cast<int>(e) - BIAS);
        return units;
    }

    void store(float* rgb) const {
        static const std::array<float, 256> UNITS = units_of_exponents();
        for (std::size_t x = 0; x < width(); ++x) {
            const Code& code = row_[header_.right_to_left ? width() - 1 - x : x];
            const float unit = UNITS[code[3]];
            for (std::size_t c = 0; c < 3; ++c) rgb[3 * x + c] = static_cast<float>(code[c]) * unit;
        }
    }

    fs::path file_;
    RadianceHeader header_;
    Bytes bytes_;
    std::vector<Code> row_;
    std::size_t next_row_ = 0;
};

}  // namespace

std::unique_ptr<ImageSource> open_radiance(const fs::path& file, const ReadOptions& options) {
    std::ifstream in(file, std::ios::binary);
    std::string text(MOST_HEADER_BYTES, '\0');
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(in.gcount()));
    const RadianceHeader header = HeaderParser(file, text).parse();
    check_size(file, header.width, header.height, options.limits);
    const bool coded = has_coded_rows(header, std::string_view(text).substr(header.size));
    check_length(file, header, coded);
    return std::make_unique<RadianceSource>(file, std::move(in), header, coded);
}

}  // namespace clerestory
