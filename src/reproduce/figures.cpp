#include "reproduce/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/atomic_file.hpp"
#include "base/clock.hpp"
#include "base/text_escape.hpp"
#include "error.hpp"
#include "fresnel/fresnel.hpp"
#include "fresnel/fresnel_report.hpp"
#include "map/png_text.hpp"
#include "map/turned_map.hpp"
#include "sampling/sample_records.hpp"
#include "sampling/stage3_sample.hpp"

namespace clerestory {
namespace {

struct FresnelFigure {
    const char* id;
    Media media;
};
constexpr std::array FRESNEL_FIGURES = {FresnelFigure{"figure_01a", {1, 1.5}}, FresnelFigure{"figure_01b", {1.5, 1}}};
constexpr unsigned FRESNEL_STEPS = 901;  // a tenth of a degree, as the fresnel command's default

struct SampleFigure {
    const char* id;
    std::size_t samples;
};
constexpr std::array SAMPLE_FIGURES = {SampleFigure{"figure_02", 64}, SampleFigure{"figure_03", 256},
                                       SampleFigure{"figure_04", 1024}};
constexpr const char* TURNED_FIGURE = "figure_07";

// A page with wider pictures than this grows by megabytes for detail that a screen does not show.
constexpr std::size_t PAGE_COLUMNS = 1536;

const char* bytes_of(const std::vector<cl_uint>& preview) { return reinterpret_cast<const char*>(preview.data()); }

std::string preview_png(const std::string& name, std::size_t width, std::size_t height,
                        const std::vector<cl_uint>& preview) {
    const auto png = png_bytes(name, width, height, 4, reinterpret_cast<const unsigned char*>(bytes_of(preview)));
    return {png.begin(), png.end()};
}

}  // namespace

const std::vector<SphereFigure>& sphere_figures() {
    static const std::vector<SphereFigure> figures = {
        {"figure_05", Estimator::shared, 64},    {"figure_06a", Estimator::shared, 256},
        {"figure_06b", Estimator::shared, 1024}, {"figure_08", Estimator::per_pixel, 8},
        {"figure_09", Estimator::per_pixel, 16}, {"figure_10", Estimator::per_pixel, 32}};
    return figures;
}

std::vector<std::string> figure_ids() {
    std::vector<std::string> ids;
    for (const auto& figure : FRESNEL_FIGURES) ids.emplace_back(figure.id);
    for (const auto& figure : SAMPLE_FIGURES) ids.emplace_back(figure.id);
    for (const auto& figure : sphere_figures()) ids.push_back(figure.id);
    ids.insert(ids.end(), {TURNED_FIGURE, "figure_11", "figure_12", "figure_13", "figure_14", "figure_15"});
    std::sort(ids.begin(), ids.end());
    return ids;
}

std::string describe(const StudySubject& subject) {
    const std::string base = subject.estimator == Estimator::shared
                                 ? fmt::format("one shared set of {}", subject.samples)
                                 : fmt::format("{} fresh samples a pixel", subject.samples);
    return subject.control_degree == 0 ? base : fmt::format("{}, control degree {}", base, subject.control_degree);
}

std::string short_number(double value) { return fmt::format("{}", value); }

Figures::Figures(const Device& device, const Scene& scene, FigureOptions options, FigureEvents events)
    : device_(device), scene_(scene), options_(std::move(options)), events_(std::move(events)) {
    if (scene.distribution().black()) throw InputError("the map is black: there is nothing to draw");
    if (!(options_.scale > 0)) throw UsageError("--scale 0 leaves nothing to draw: give a number above 0");
    const auto known = figure_ids();
    for (const auto& id : options_.only) {
        if (std::find(known.begin(), known.end(), id) == known.end()) {
            throw UsageError(fmt::format("no figure is named {}: choose of {}", id, fmt::join(known, ", ")));
        }
    }
}

bool Figures::wanted(const std::string& id) const {
    return options_.only.empty() || std::find(options_.only.begin(), options_.only.end(), id) != options_.only.end();
}

bool Figures::any_wanted(const std::vector<std::string>& ids) const {
    return std::any_of(ids.begin(), ids.end(), [this](const std::string& id) { return wanted(id); });
}

RenderOptions Figures::method_of(const StudySubject& subject) const {
    RenderOptions method;
    method.estimator = subject.estimator;
    method.samples = subject.samples;
    method.size = options_.size;
    method.scale = options_.scale;
    method.sampling.seed = options_.seed;
    method.sampling.rotate_y_deg = options_.rotate_y_deg;
    method.sampling.control_degree = subject.control_degree;
    return method;
}

const ExactPicture& Figures::exact() {
    if (exact_ == nullptr) {
        exact_ = &meter_.lit_exact(method_of({}), [this](double done, double total) {
            if (events_.progress) events_.progress("exact sphere", done, total);
        });
        report_["exact"] = {{"seconds", exact_->times.total()},
                            {"mean_radiance", gain() * std::ldexp(exact_->mean, scene_.distribution().exponent)},
                            {"pixels", statistics_.pixels()}};
    }
    return *exact_;
}

ToneOptions Figures::tone() {
    if (!exposure_) {
        exposure_ = options_.exposure;
        if (!exposure_) {
            (void)exact();
            exposure_ = meter_.bright_exposure(method_of({}), gain(), options_.gamma);
        }
        report_["exposure"] = *exposure_;
        report_["exposure_chosen"] = !options_.exposure.has_value();
    }
    return {*exposure_, options_.gamma};
}

std::string Figures::command(const std::string& name, const std::vector<std::string>& words, bool with_map) const {
    std::string line = fmt::format("clerestory {}", name);
    const auto append = [&](const std::string& word) { line += fmt::format(" {}", shell_word(word)); };
    if (with_map) std::for_each(options_.map_words.begin(), options_.map_words.end(), append);
    std::for_each(words.begin(), words.end(), append);
    return line;
}

std::vector<std::string> Figures::changed_words(bool of_sphere) const {
    const FigureOptions defaults;
    std::vector<std::string> words;
    const auto add_word = [&](const char* flag, const std::string& value, bool changed) {
        if (changed) words.insert(words.end(), {flag, value});
    };
    add_word("--scale", short_number(options_.scale), options_.scale != defaults.scale);
    add_word("--size", std::to_string(options_.size), of_sphere && options_.size != defaults.size);
    add_word("--gamma", short_number(options_.gamma), options_.gamma != defaults.gamma);
    return words;
}

std::string Figures::own_command(const std::string& id) const {
    const FigureOptions defaults;
    std::vector<std::string> words = {"--only", id, "--seed", std::to_string(options_.seed)};
    const auto changed = changed_words(true);
    words.insert(words.end(), changed.begin(), changed.end());
    if (options_.rotate_y_deg != defaults.rotate_y_deg) {
        words.insert(words.end(), {"--rotate-y", short_number(options_.rotate_y_deg)});
    }
    if (options_.seeds != defaults.seeds) words.insert(words.end(), {"--seeds", std::to_string(options_.seeds)});
    if (options_.exposure) words.insert(words.end(), {"--exposure", short_number(*options_.exposure)});
    words.insert(words.end(), {"-o", "."});
    return command("reproduce", words);
}

std::vector<std::string> Figures::sphere_words(const std::string& file) {
    std::vector<std::string> words = {"--rotate-y", short_number(options_.rotate_y_deg), "--exposure",
                                      short_number(tone().exposure)};
    const auto changed = changed_words(true);
    words.insert(words.end(), changed.begin(), changed.end());
    words.insert(words.end(), {"-o", file});
    return words;
}

void Figures::write(const std::string& file, std::string_view bytes) {
    const auto path = options_.folder / file;
    write_bytes(path, bytes);
    if (events_.written) events_.written(path.string());
}

void Figures::add(const std::string& id, const std::string& file, const std::string& bytes, nlohmann::json numbers) {
    write(file, bytes);
    numbers["file"] = file;
    report_["figures"][id] = std::move(numbers);
    pictures_[id] = bytes;
}

std::string Figures::picture_png(const std::vector<float>& rgba) {
    const auto preview = renderer_.display().preview(rgba, 4, tone());
    return preview_png("the sphere", options_.size, options_.size, preview);
}

void Figures::fresnel() {
    for (const auto& [id, media] : FRESNEL_FIGURES) {
        if (!wanted(id)) continue;
        const Stopwatch watch;
        const auto curves = fresnel_curves(device_, media, incidence_angles(FRESNEL_STEPS));
        const auto facts = fresnel_facts(media);
        auto numbers = fresnel_json(media, facts, curves);
        const std::string file = std::string(id) + ".svg";
        numbers["command"] = command("fresnel",
                                     {"--ior-incident", short_number(media.ior_incident), "--ior-transmitted",
                                      short_number(media.ior_transmitted), "-o", file},
                                     false);
        numbers["seconds"] = watch.seconds();
        add(id, file, plot::svg(fresnel_plot(id, media, facts, curves)), std::move(numbers));
    }
}

void Figures::samples() {
    SamplingOptions sampling;
    sampling.sequence = Sequence::random;
    sampling.seed = options_.seed;
    std::optional<Sampler> sampler;
    for (const auto& [id, count] : SAMPLE_FIGURES) {
        if (!wanted(id)) continue;
        if (!sampler) {
            sampler.emplace(device_, scene_.device_map(), scene_.distribution(), sampling);
            sampler->draw(count);  // the first launch of a kernel compiles it
        }
        const Stopwatch watch;
        const SampleSet set = sampler->draw(count);
        device_.finish();
        sample_map(id, set, watch.seconds());
    }
}

void Figures::sample_map(const std::string& id, const SampleSet& set, double seconds) {
    const RadianceMap& map = scene_.map();
    const std::string csv = id + ".csv";
    write(csv, samples_csv(sample_records(set, scene_.distribution())));
    auto texels = set.texel.download();
    std::sort(texels.begin(), texels.end());
    const auto distinct = std::unique(texels.begin(), texels.end()) - texels.begin();
    const std::size_t factor = shrink_factor(map, PAGE_COLUMNS);
    std::vector<std::string> words = {"--sequence", "random",
                                      "-n",         std::to_string(set.count),
                                      "--seed",     std::to_string(options_.seed),
                                      "--exposure", short_number(tone().exposure)};
    const auto changed = changed_words(false);
    words.insert(words.end(), changed.begin(), changed.end());
    words.insert(words.end(), {"-o", "."});
    const auto marked = renderer_.display().marked_preview(map, gain(), tone(), set.texel);
    add(id, id + ".png", preview_png(id, map.width, map.height, marked),
        {{"csv", csv},
         {"samples", set.count},
         {"seed", options_.seed},
         {"distinct_texels", distinct},
         {"distinct_share", static_cast<double>(distinct) / static_cast<double>(map.width * map.height)},
         {"page_shrink", factor},
         {"seconds", seconds},
         {"command", command("sample", words)}});
    if (factor == 1) return;
    // Marks of 5x5 texels vanish where a large map is shown small: the page marks the small one.
    const RadianceMap small = shrunk_map(map, factor);
    auto places = set.texel.download();
    for (auto& texel : places) {
        const std::size_t row = texel / map.width / factor;
        texel = static_cast<cl_uint>(row * small.width + texel % map.width / factor);
    }
    const Buffer<cl_uint> small_texels(device_, "the marks", std::span<const cl_uint>(places));
    pictures_[id] = preview_png(id, small.width, small.height,
                                renderer_.display().marked_preview(small, gain(), tone(), small_texels));
}

nlohmann::json Figures::sphere(const std::string& id, const StudySubject& subject) {
    const RenderOptions options = method_of(subject);
    const double seconds = meter_.time(options).total();
    const Rendered picture = renderer_.render(scene_, options);
    const std::string file = id + ".png";
    auto words = sphere_words(file);
    words.insert(words.begin(), {"--estimator", estimator_name(subject.estimator), "--sequence", "random", "-n",
                                 std::to_string(subject.samples), "--control-degree",
                                 std::to_string(subject.control_degree), "--seed", std::to_string(options_.seed)});
    const ErrorParts parts = statistics_.parts_of(meter_.errors_of_picture(options, picture.rgba, gain()));
    write(file, pictures_[id] = picture_png(picture.rgba));
    return {{"file", file},
            {"samples", subject.samples},
            {"estimator", estimator_name(subject.estimator)},
            {"control_degree", subject.control_degree},
            {"seed", options_.seed},
            {"rel_rmse", parts.rel_rmse},
            {"bias", parts.rel_bias},
            {"neighbour_correlation", parts.neighbour_correlation},
            {"block_side", statistics_.block_sides().back()},
            {"block_rms", parts.block_rms.back()},
            {"seconds", seconds},
            {"command", command("render", words)}};
}

void Figures::spheres() {
    for (const auto& [id, estimator, count] : sphere_figures()) {
        if (!wanted(id)) continue;
        nlohmann::json numbers = sphere(id, {estimator, 0, count});
        numbers["control"] = sphere(id + "_control", {estimator, CONTROL_DEGREE, count});
        report_["figures"][id] = std::move(numbers);
    }
}

void Figures::turned() {
    if (!wanted(TURNED_FIGURE)) return;
    const Stopwatch watch;
    const RadianceMap map = turned_map(scene_.map(), options_.rotate_y_deg);
    const auto png_of = [&](const RadianceMap& shown) {
        const std::span<const float> radiance(shown.rgb.data(), shown.rgb.size());
        ToneOptions preview = tone();
        preview.exposure *= gain();
        return preview_png(TURNED_FIGURE, shown.width, shown.height, renderer_.display().preview(radiance, 3, preview));
    };
    const std::size_t factor = shrink_factor(map, PAGE_COLUMNS);
    const double columns = options_.rotate_y_deg / 360 * static_cast<double>(map.width);
    add(TURNED_FIGURE, std::string(TURNED_FIGURE) + ".png", png_of(map),
        {{"rotate_y", options_.rotate_y_deg},
         {"columns", columns},
         {"page_shrink", factor},
         {"seconds", watch.seconds()},
         {"command", own_command(TURNED_FIGURE)}});
    if (factor > 1) pictures_[TURNED_FIGURE] = png_of(shrunk_map(map, factor));
}

void Figures::make() {
    fresnel();
    samples();
    turned();
    spheres();
    truth();
    error_images();
    seed_images();
    blocks();
    convergence();
}

}  // namespace clerestory
