#include "batch/job_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <optional>

#include "batch/batch_limits.hpp"
#include "batch/mistakes.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

/// The most of something that the text has at once, and where it first has too much.
struct Peak {
    std::size_t limit;
    std::size_t most = 0;
    std::optional<std::size_t> exceeded_at = {};

    void reach(std::size_t count, std::size_t at) {
        most = std::max(most, count);
        if (count > limit && !exceeded_at) exceeded_at = at;
    }
};

/// What is read as brackets, dots and "=" of TOML, and what is a string or a comment. Strings of one line end with it,
/// right or wrong: toml++ refuses the file there.
class TextScan {
  public:
    explicit TextScan(const std::string& text) : text_(text) {}

    void run() {
        while (at_ < text_.size()) step(text_[at_]);
    }

    Peak brackets{batch_limits::DEEPEST};
    Peak parts{batch_limits::DEEPEST};
    Peak tables{batch_limits::MOST_TABLES};

  private:
    void step(char c) {
        if (c == '#') return skip_comment();
        if (c == '"' || c == '\'') return skip_string(c);
        if (c == '[' || c == '{') open();
        if (c == ']' || c == '}') close();
        if (c == '.') parts.reach(++dots_ + 1, at_);
        if (c == '=') end_key();
        if (c == ',') dots_ = 0;
        if (c == '\n') end_line();
        ++at_;
    }

    void open() {
        if (depth_ == 0 && !in_value_) add_tables(1);  // a header
        brackets.reach(++depth_, at_);
        dots_ = 0;
    }
    void close() {
        if (depth_ > 0) --depth_;
        if (depth_ == 0 && !in_value_) add_tables(dots_);
        dots_ = 0;
    }
    void end_key() {
        add_tables(dots_);
        dots_ = 0;
        if (depth_ == 0) in_value_ = true;
    }
    void end_line() {
        dots_ = 0;
        if (depth_ == 0) in_value_ = false;
    }
    void add_tables(std::size_t count) { tables.reach(tables_ += count, at_); }

    void skip_comment() { at_ = std::min(text_.find('\n', at_), text_.size()); }

    void skip_string(char quote) {
        if (is_triple(quote)) return skip_long_string(quote);
        for (++at_; at_ < text_.size() && text_[at_] != '\n'; ++at_) {
            if (text_[at_] == quote) {
                ++at_;
                return;
            }
            if (escapes(quote)) ++at_;
        }
    }
    void skip_long_string(char quote) {
        for (at_ += 3; at_ < text_.size() && !is_triple(quote); ++at_) {
            if (escapes(quote)) ++at_;
        }
        at_ = std::min(at_ + 3, text_.size());
        // One or two quotes before the three are part of the string.
        for (int more = 0; more < 2 && at_ < text_.size() && text_[at_] == quote; ++more) ++at_;
    }
    [[nodiscard]] bool is_triple(char quote) const {
        return at_ + 2 < text_.size() && text_[at_] == quote && text_[at_ + 1] == quote && text_[at_ + 2] == quote;
    }
    [[nodiscard]] bool escapes(char quote) const { return quote == '"' && text_[at_] == '\\'; }

    const std::string& text_;
    std::size_t at_ = 0;
    std::size_t depth_ = 0;
    std::size_t dots_ = 0;  ///< since anything that ends a key
    std::size_t tables_ = 0;
    bool in_value_ = false;  ///< behind the "=" of a line, where brackets are those of lists
};

/// Columns count characters, as toml++ does.
Place place_in(const std::string& text, std::size_t at) {
    constexpr unsigned CONTINUATION_MASK = 0xc0;
    constexpr unsigned CONTINUATION = 0x80;
    Place place;
    for (std::size_t i = 0; i < at; ++i) {
        if (text[i] == '\n') {
            ++place.line;
            place.column = 1;
        } else if ((static_cast<unsigned char>(text[i]) & CONTINUATION_MASK) != CONTINUATION) {
            ++place.column;
        }
    }
    return place;
}

}  // namespace

void check_job_text(const std::filesystem::path& file, const std::string& text) {
    TextScan scan(text);
    scan.run();
    const auto refuse = [&](const Peak& peak, const char* what) {
        if (!peak.exceeded_at) return;
        throw InputError(located(file, place_in(text, *peak.exceeded_at),
                                 fmt::format("{} {}; {} are the most of a job file", peak.most, what, peak.limit)));
    };
    refuse(scan.brackets, "brackets and braces stand within one another");
    refuse(scan.parts, "parts make one key");
    refuse(scan.tables, "tables are named by headers and dotted keys");
}

}  // namespace clerestory
