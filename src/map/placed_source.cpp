#include "map/placed_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace clerestory {
namespace {

std::string text_of(const Window& window) {
    return fmt::format("{} x {} at ({}, {})", window.width, window.height, window.x, window.y);
}

/// What two windows have in common; no width or no height where that is nothing.
Window common(const Window& a, const Window& b) {
    const auto size = [](std::int64_t begin, std::int64_t end) {
        return static_cast<std::size_t>(std::max(begin, end) - begin);
    };
    const auto end = [](std::int64_t begin, std::size_t length) { return begin + static_cast<std::int64_t>(length); };
    const std::int64_t x = std::max(a.x, b.x);
    const std::int64_t y = std::max(a.y, b.y);
    return {x, y, size(x, std::min(end(a.x, a.width), end(b.x, b.width))),
            size(y, std::min(end(a.y, a.height), end(b.y, b.height)))};
}

MapSource placed_description(const ImageSource& source, const Window& data, const Window& display) {
    const bool covered = common(data, display) == display;
    MapSource all = source.described();
    all.plain = false;
    all.notes.push_back({"cropped", fmt::format("holds {} of a picture of {}{}", text_of(data), text_of(display),
                                                covered ? "; what lies outside it was cut" : "; the rest is black")});
    return all;
}

class PlacedSource final : public ImageSource {
  public:
    PlacedSource(std::unique_ptr<ImageSource> source, const Window& data, const Window& display)
        : ImageSource(display.width, display.height, source->chunk_rows(), source->has_alpha(),
                      placed_description(*source, data, display)),
          source_(std::move(source)) {
        const Window shown = common(data, display);
        to_column_ = static_cast<std::size_t>(shown.x - display.x);
        from_column_ = static_cast<std::size_t>(shown.x - data.x);
        columns_ = shown.width;
        to_row_ = static_cast<std::size_t>(shown.y - display.y);
        from_row_ = static_cast<std::size_t>(shown.y - data.y);
        rows_ = shown.height;
        if (source_->is_cube()) mark_cube();
    }

    [[nodiscard]] bool rings() const noexcept override { return source_->rings(); }

    void read_rows(std::size_t begin, std::size_t end, Rows rgb, Rows alpha) override {
        for (std::size_t r = begin; r < end; ++r) {
            std::fill_n(rgb.row(r), 3 * width(), 0.0F);
            if (alpha.first) std::fill_n(alpha.row(r), width(), 0.0F);
        }
        const std::size_t first = std::max(begin, to_row_);
        const std::size_t last = std::min(end, to_row_ + rows_);
        // As many rows at a time as the source decodes together, however many are wanted.
        const std::size_t step = std::max(source_->chunk_rows(), MOST_ROWS / source_->chunk_rows() * chunk_rows());
        for (std::size_t r = first; r < last;) {
            const std::size_t from = r - to_row_ + from_row_;
            const std::size_t block = from / source_->chunk_rows() * source_->chunk_rows();
            const std::size_t block_end = std::min(block + step, source_->height());
            const std::size_t count = std::min(last - r, block_end - from);
            read_block(block, block_end, alpha.first != nullptr);
            for (std::size_t i = 0; i < count; ++i) copy_row(from - block + i, r + i, rgb, alpha);
            r += count;
        }
    }

  private:
    static constexpr std::size_t MOST_ROWS = 256;

    void read_block(std::size_t begin, std::size_t end, bool with_alpha) {
        const std::size_t texels = (end - begin) * source_->width();
        rgb_.resize(3 * texels);
        alpha_.resize(with_alpha ? texels : 0);
        const auto stride = static_cast<std::ptrdiff_t>(source_->width());
        // Rows are counted from the source's first one.
        const auto skipped = static_cast<std::ptrdiff_t>(begin) * stride;
        source_->read_rows(begin, end, {rgb_.data() - 3 * skipped, 3 * stride},
                           with_alpha ? Rows{alpha_.data() - skipped, stride} : Rows{});
    }

    void copy_row(std::size_t from, std::size_t to, Rows rgb, Rows alpha) const {
        const std::size_t begin = from * source_->width() + from_column_;
        std::copy_n(rgb_.data() + 3 * begin, 3 * columns_, rgb.row(to) + 3 * to_column_);
        if (alpha.first) std::copy_n(alpha_.data() + begin, columns_, alpha.row(to) + to_column_);
    }

    std::unique_ptr<ImageSource> source_;
    std::size_t to_column_ = 0;  ///< of the display window, where the data's columns begin
    std::size_t from_column_ = 0;
    std::size_t columns_ = 0;
    std::size_t to_row_ = 0;
    std::size_t from_row_ = 0;
    std::size_t rows_ = 0;
    std::vector<float> rgb_;  ///< of the rows that were decoded last
    std::vector<float> alpha_;
};

}  // namespace

std::unique_ptr<ImageSource> placed(const std::filesystem::path& file, std::unique_ptr<ImageSource> source,
                                    const Window& data, const Window& display, const ReadLimits& limits) {
    if (data == display) return source;
    check_size(file, display.width, display.height, limits);
    const Window shown = common(data, display);
    if (shown.width == 0 || shown.height == 0) {
        throw refused(file, fmt::format("its texels ({}) lie outside its display window ({}), so that nothing would "
                                        "light; set the display window anew",
                                        text_of(data), text_of(display)));
    }
    return std::make_unique<PlacedSource>(std::move(source), data, display);
}

}  // namespace clerestory
