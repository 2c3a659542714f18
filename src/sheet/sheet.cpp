#include "sheet/sheet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "draw/colour_map.hpp"
#include "error.hpp"
#include "map/turned_map.hpp"
#include "measure/error_meter.hpp"
#include "measure/error_statistics.hpp"
#include "sampling/sample_records.hpp"
#include "sampling/stage3_sample.hpp"

namespace clerestory {
namespace {

/// A picture that waits for its place.
struct Piece {
    std::vector<unsigned char> rgba;
    std::size_t width = 0;
    std::size_t height = 0;
    std::size_t factor = 1;
    std::size_t left = 0;
    std::size_t top = 0;
};

std::vector<unsigned char> rgba_of(const std::vector<cl_uint>& preview) {
    const auto* bytes = reinterpret_cast<const unsigned char*>(preview.data());
    return {bytes, bytes + 4 * preview.size()};
}

/// Each texel as a square of `factor` x `factor`.
RadianceMap enlarged_map(const RadianceMap& map, std::size_t factor) {
    RadianceMap large;
    large.width = factor * map.width;
    large.height = factor * map.height;
    large.rgb = PageBuffer(3 * large.width * large.height);
    for (std::size_t i = 0; i < large.height; ++i) {
        for (std::size_t j = 0; j < large.width; ++j) {
            const float* from = map.rgb.data() + 3 * (i / factor * map.width + j / factor);
            std::copy(from, from + 3, large.rgb.data() + 3 * (i * large.width + j));
        }
    }
    return large;
}

/// The map as it is turned, in whole multiples or parts of its size so that it fits into 2 panel x panel.
RadianceMap panel_map(const RadianceMap& map, std::size_t panel, double rotate_y_deg) {
    const std::size_t shrink = std::max(shrink_factor(map, 2 * panel), (map.height + panel - 1) / panel);
    if (shrink > 1) return turned_map(shrunk_map(map, shrink), rotate_y_deg);
    return turned_map(enlarged_map(map, std::min(2 * panel / map.width, panel / map.height)), rotate_y_deg);
}

/// A number above 0 with two digits, or all of those before the point.
std::string two_digits(double value) {
    return value < 10 ? fmt::format("{:#.2g}", value) : fmt::format("{:.0f}", value);
}

class SheetMaker {
  public:
    SheetMaker(const Device& device, const Scene& scene, const SheetOptions& options, const ProgressFunction& progress)
        : device_(device),
          scene_(scene),
          options_(options),
          renderer_(device),
          side_(SUPERSAMPLING * options.panel),
          gain_(options.render.albedo * options.render.scale),
          rotate_y_deg_(options.render.sampling.rotate_y_deg),
          map_(panel_map(scene.map(), options.panel, rotate_y_deg_)),
          meter_(renderer_, scene),
          statistics_(meter_.view(side_)),
          exact_(meter_.lit_exact(sphere(), progress)),
          tone_{options.exposure ? *options.exposure : meter_.bright_exposure(sphere(), gain_, options.gamma),
                options.gamma} {}

    Sheet make() {
        add_head();
        add_reference();
        for (std::size_t k = 0; k < options_.counts.size(); ++k) add_row(k);
        add_errors();
        Canvas canvas(width(), row_top(options_.counts.size() + 1) - CAPTION + MARGIN - GAP, GROUND, labels_);
        for (const Piece& p : pieces_) canvas.lay(p.rgba, p.width, p.height, p.factor, p.left, p.top);
        report_["exposure"] = tone_.exposure;
        report_["limit"] = limit_;
        return {std::move(canvas), std::move(report_)};
    }

  private:
    // Colours of the ground and of text: the plots' own ink on a paper a little darker than the error's zero, so that
    // an error of nothing still shows as a disc.
    static constexpr Rgb GROUND = {229, 229, 224};
    static constexpr Rgb INK = {36, 41, 47};
    static constexpr Rgb PALE_INK = {87, 96, 106};

    // Pixels.
    static constexpr std::size_t MARGIN = 28;
    static constexpr std::size_t GAP = 20;
    static constexpr std::size_t HEAD = 86;     ///< title and the line below
    static constexpr std::size_t CAPTION = 30;  ///< above each row of pictures
    static constexpr std::size_t BAR = 16;      ///< width of the error's scale
    static constexpr std::size_t SUPERSAMPLING = 2;

    [[nodiscard]] std::size_t width() const { return 2 * MARGIN + 2 * GAP + 4 * options_.panel; }
    [[nodiscard]] std::size_t sphere_left() const { return MARGIN + 2 * options_.panel + GAP; }
    [[nodiscard]] std::size_t error_left() const { return sphere_left() + options_.panel + GAP; }
    /// Upper edge of a row's pictures; row 0 is the reference.
    [[nodiscard]] std::size_t row_top(std::size_t row) const {
        return HEAD + CAPTION + row * (options_.panel + CAPTION + GAP);
    }

    /// Points of a text that must fit above a sphere.
    [[nodiscard]] double text_size(double largest) const {
        constexpr double ROOMY_PANEL = 180;
        return largest * std::min(1.0, static_cast<double>(options_.panel) / ROOMY_PANEL);
    }
    void add_label(double x, double y, const std::string& text, double size, Rgb ink, bool bold = false,
                   Align align = Align::left) {
        labels_.push_back({x, y, text, size, align, bold, ink});
    }
    void add_caption(std::size_t row, std::size_t left, const std::string& text, bool bold = false) {
        constexpr double ABOVE = 14;
        add_label(static_cast<double>(left), static_cast<double>(row_top(row)) - ABOVE, text, text_size(12),
                  bold ? INK : PALE_INK, bold);
    }
    void add_map(std::size_t row, const std::vector<cl_uint>& preview) {
        pieces_.push_back(
            {rgba_of(preview), map_.width, map_.height, 1, MARGIN, row_top(row) + (options_.panel - map_.height) / 2});
    }
    void add_square(std::size_t row, std::size_t left, std::vector<unsigned char> rgba) {
        pieces_.push_back({std::move(rgba), options_.panel, options_.panel, SUPERSAMPLING, left, row_top(row)});
    }

    void add_head() {
        const auto& sampling = options_.render.sampling;
        std::string line = fmt::format("{} estimator, {} points, seed {}, ", estimator_name(options_.render.estimator),
                                       sequence_name(sampling.sequence), sampling.seed);
        line += sampling.control_degree == 0 ? "no control variate"
                                             : fmt::format("control variate of degree {}", sampling.control_degree);
        add_label(MARGIN, 38, options_.title, 20, INK, true);
        add_label(MARGIN, 66, line, 12, PALE_INK);
    }

    void add_reference() {
        const std::span<const float> radiance(map_.rgb.data(), map_.rgb.size());
        ToneOptions tone = tone_;
        tone.exposure *= gain_;
        const std::string turn = rotate_y_deg_ == 0 ? "" : fmt::format(", turned by {}°", rotate_y_deg_);
        add_caption(0, MARGIN, fmt::format("Map, {} × {}{}", scene_.map().width, scene_.map().height, turn));
        add_caption(0, sphere_left(), "Exact");
        add_map(0, renderer_.display().preview(radiance, 3, tone));
        const auto exact =
            renderer_.display().compose(meter_.view(side_), exact_.light, gain_, scene_.distribution().exponent);
        add_square(0, sphere_left(), rgba_of(renderer_.display().preview(exact, 4, tone_)));
    }

    /// Places of samples on the panel's map, by their directions.
    std::vector<cl_uint> places_of(const SampleSet& set) const {
        std::vector<cl_uint> places;
        const auto step = [](double share, std::size_t count) {
            return std::min(static_cast<std::size_t>(share * static_cast<double>(count)), count - 1);
        };
        for (const SampleRecord& record : sample_records(set, scene_.distribution())) {
            const std::size_t row = step(record.theta / std::numbers::pi, map_.height);
            const std::size_t column = step(record.phi / (2 * std::numbers::pi), map_.width);
            places.push_back(static_cast<cl_uint>(row * map_.width + column));
        }
        return places;
    }

    /// How a sphere is lit, but for the number of samples.
    [[nodiscard]] RenderOptions sphere() const {
        RenderOptions options = options_.render;
        options.size = side_;
        return options;
    }

    void add_row(std::size_t k) {
        const std::size_t row = k + 1;
        RenderOptions options = sphere();
        options.samples = options_.counts[k];
        if (!sampler_) sampler_.emplace(device_, scene_.device_map(), scene_.distribution(), options.sampling);
        const auto places = places_of(sampler_->draw(options.samples));
        const Buffer<cl_uint> marks(device_, "the marks", std::span<const cl_uint>(places));
        add_map(row, renderer_.display().marked_preview(map_, gain_, tone_, marks));
        const Rendered picture = renderer_.render(scene_, options);
        add_square(row, sphere_left(), rgba_of(renderer_.display().preview(picture.rgba, 4, tone_)));
        const ErrorPlanes errors = meter_.errors_of_picture(options, picture.rgba, gain_);
        const double rel_rmse = statistics_.parts_of(errors).rel_rmse;
        errors_.push_back(statistics_.as_picture(errors));
        const char* each = options.estimator == Estimator::per_pixel ? " a pixel" : "";
        add_caption(row, MARGIN, fmt::format("N = {}{}", options.samples, each), true);
        add_caption(row, sphere_left(), "Sphere");
        add_caption(row, error_left(), "Relative RMSE " + two_digits(100 * rel_rmse) + "%", true);
        report_["rows"].push_back({{"samples", options.samples}, {"rel_rmse", rel_rmse}});
    }

    /// Error pictures on one scale, which stands beside the exact sphere.
    void add_errors() {
        std::vector<std::span<const float>> pictures(errors_.begin(), errors_.end());
        limit_ = round_limit(pictures);
        for (std::size_t k = 0; k < errors_.size(); ++k) {
            add_square(k + 1, error_left(), coloured(errors_[k], ColourMap::diverging, limit_));
        }
        constexpr std::size_t TEXT_LEFT = 28;
        add_caption(0, error_left(), "Relative error");
        Piece bar{{}, BAR, options_.panel, 1, error_left(), row_top(0)};
        for (std::size_t y = 0; y < bar.height; ++y) {
            const double share = (static_cast<double>(y) + 0.5) / static_cast<double>(bar.height);
            const Colour colour = colour_at(ColourMap::diverging, 1 - 2 * share);
            for (std::size_t x = 0; x < bar.width; ++x) {
                for (const double c : colour) bar.rgba.push_back(static_cast<unsigned char>(std::lround(c)));
                bar.rgba.push_back(255);
            }
        }
        pieces_.push_back(std::move(bar));
        constexpr std::array<double, 5> PARTS = {1, 0.25, 0, -0.25, -1};  // even steps of the root
        constexpr std::array<const char*, 5> NOTES = {" too bright", "", "", "", " too dark"};
        constexpr double INSET = 7;  // keeps the outer texts within the bar's ends
        for (std::size_t i = 0; i < PARTS.size(); ++i) {
            const double share = (1 - colour_place(PARTS[i])) / 2;
            const double y = INSET + share * (static_cast<double>(options_.panel) - 2 * INSET);
            const std::string sign = PARTS[i] > 0 ? "+" : PARTS[i] < 0 ? "−" : "";
            add_label(static_cast<double>(error_left() + TEXT_LEFT), static_cast<double>(row_top(0)) + y,
                      sign + tick_percent(std::abs(PARTS[i]) * limit_) + NOTES[i], text_size(11), PALE_INK);
        }
    }

    const Device& device_;
    const Scene& scene_;
    const SheetOptions& options_;
    Renderer renderer_;
    std::size_t side_;
    double gain_;
    double rotate_y_deg_;
    RadianceMap map_;
    ErrorMeter meter_;
    ErrorStatistics statistics_;
    const ExactPicture& exact_;
    ToneOptions tone_;
    std::optional<Sampler> sampler_;
    std::vector<Label> labels_;
    std::vector<Piece> pieces_;
    std::vector<std::vector<float>> errors_;
    double limit_ = 0;
    nlohmann::json report_ = {{"rows", nlohmann::json::array()}};
};

}  // namespace

Sheet make_sheet(const Device& device, const Scene& scene, const SheetOptions& options,
                 const ProgressFunction& progress) {
    if (scene.distribution().black()) throw InputError("the map is black: there is nothing to draw samples from");
    if (!(options.render.scale > 0 && options.render.albedo > 0)) {
        throw UsageError("a scale or an albedo of 0 leaves nothing to show: give a number above 0");
    }
    return SheetMaker(device, scene, options, progress).make();
}

}  // namespace clerestory
