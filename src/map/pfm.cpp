#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "map/image_source.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// More than any header with its comments.
constexpr std::size_t PFM_HEADER_BYTES = 4096;

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' || c == '\f'; }

/// What a PFM file's header says.
struct PfmHeader {
    std::size_t channels = 3;  ///< 1 for grey
    std::size_t width = 0;
    std::size_t height = 0;
    float scale = 1;  ///< of the values
    bool big_endian = false;
    bool top_down = false;  ///< rows are stored from the top
    std::size_t size = 0;   ///< bytes before the first value
};

/// Reads a header's words one by one.
class Words {
  public:
    explicit Words(std::string_view text) : text_(text) {}

    /// The next word; "" at the end. Blanks and comments before it are passed over.
    std::string_view next() {
        while (at_ < text_.size() && (is_blank(text_[at_]) || text_[at_] == '#')) {
            if (text_[at_] == '#') {
                at_ = std::min(text_.find('\n', at_), text_.size());
            } else {
                ++at_;
            }
        }
        const std::size_t begin = at_;
        while (at_ < text_.size() && !is_blank(text_[at_])) ++at_;
        return text_.substr(begin, at_ - begin);
    }
    /// Bytes up to the end of the last word.
    [[nodiscard]] std::size_t position() const noexcept { return at_; }
    /// The byte that ended the last word; 0 at the end.
    [[nodiscard]] char separator() const noexcept { return at_ < text_.size() ? text_[at_] : '\0'; }

  private:
    std::string_view text_;
    std::size_t at_ = 0;
};

template <class Number>
std::optional<Number> number_of(std::string_view word) {
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return {};
    return value;
}

/// Blanks between the scale and the values: one, or as many as the file is longer than it need be, as long as they are
/// blanks. Writers end the header with \n, \r\n, or a blank before either.
std::size_t blanks_before_values(std::string_view rest, std::uintmax_t spare) {
    constexpr std::uintmax_t MOST = 8;
    const auto wanted = static_cast<std::size_t>(std::min(spare, MOST));
    const std::size_t found = static_cast<std::size_t>(
        std::find_if_not(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(std::min(wanted, rest.size())),
                         is_blank) -
        rest.begin());
    if (found == spare) return found;
    return rest.substr(0, 2) == "\r\n" && spare >= 2 ? 2 : 1;
}

PfmHeader parse_header(const fs::path& file, std::string_view text, std::uintmax_t file_size,
                       const ReadLimits& limits) {
    PfmHeader header;
    Words words(text);
    header.channels = words.next() == "Pf" ? 1 : 3;
    const auto width = number_of<std::int64_t>(words.next());
    // Photoshop gives width and height a line each, and stores the top row first.
    header.top_down = words.separator() == '\n' || words.separator() == '\r';
    const auto height = number_of<std::int64_t>(words.next());
    const auto scale = number_of<float>(words.next());
    if (!width || !height || !scale || words.separator() == '\0') {
        throw damaged(file, "its PFM header should hold a width, a height and a scale");
    }
    if (!std::isfinite(*scale) || *scale == 0) {
        throw damaged(file, "the scale in its PFM header should be a number other than 0");
    }
    header.width = static_cast<std::size_t>(std::max<std::int64_t>(*width, 0));
    header.height = static_cast<std::size_t>(std::max<std::int64_t>(*height, 0));
    check_size(file, header.width, header.height, limits);
    header.big_endian = *scale > 0;
    header.scale = std::abs(*scale);

    const std::uintmax_t values = header.width * header.height * header.channels * sizeof(float);
    if (file_size - words.position() <= values) {
        throw damaged(file, fmt::format("{} bytes of values in place of {}", file_size - words.position() - 1, values));
    }
    header.size =
        words.position() + blanks_before_values(text.substr(words.position()), file_size - words.position() - values);
    return header;
}

/// Portable float map. Source: netpbm's pfm(5), whose Photoshop variant has the top row first.
class PfmSource final : public ImageSource {
  public:
    PfmSource(fs::path file, std::ifstream in, const PfmHeader& header)
        : ImageSource(header.width, header.height, 1, false, source_of(header)),
          file_(std::move(file)),
          in_(std::move(in)),
          header_(header) {}

    void read_rows(std::size_t begin, std::size_t end, Rows rgb, Rows /*alpha*/) override {
        row_.resize(width() * header_.channels);
        for (std::size_t r = begin; r < end; ++r) {
            load(header_.top_down ? r : height() - 1 - r);
            store(rgb.row(r));
        }
    }

  private:
    static MapSource source_of(const PfmHeader& header) {
        MapSource source;
        source.format = "PFM";
        source.compression = "none";
        source.type = "float";
        source.channels =
            header.channels == 1 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
        if (header.top_down) {
            source.notes.push_back({"top_down",
                                    "has the header of Photoshop, which stores the top row first; --flip-y "
                                    "turns the map if this one does not"});
        }
        return source;
    }

    void load(std::size_t stored_row) {
        const std::size_t bytes = row_.size() * sizeof(float);
        in_.seekg(static_cast<std::streamoff>(header_.size + stored_row * bytes));
        in_.read(reinterpret_cast<char*>(row_.data()), static_cast<std::streamsize>(bytes));
        if (!in_) throw damaged(file_, "it ends before its last row");
    }

    [[nodiscard]] float decoded(std::uint32_t bits) const {
        if (header_.big_endian) bits = __builtin_bswap32(bits);
        return std::bit_cast<float>(bits) * header_.scale;
    }

    void store(float* rgb) const {
        for (std::size_t x = 0; x < width(); ++x) {
            for (std::size_t c = 0; c < 3; ++c)
                rgb[3 * x + c] = decoded(row_[header_.channels * x + c % header_.channels]);
        }
    }

    fs::path file_;
    std::ifstream in_;
    PfmHeader header_;
    std::vector<std::uint32_t> row_;
};

}  // namespace

std::unique_ptr<ImageSource> open_pfm(const fs::path& file, const ReadOptions& options) {
    std::error_code error;
    const std::uintmax_t size = fs::file_size(file, error);
    std::ifstream in(file, std::ios::binary);
    if (error || !in) throw refused(file, "cannot be opened; check its permissions");
    std::string text(PFM_HEADER_BYTES, '\0');
    in.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(in.gcount()));
    in.clear();
    const PfmHeader header = parse_header(file, text, size, options.limits);
    return std::make_unique<PfmSource>(file, std::move(in), header);
}

}  // namespace clerestory
