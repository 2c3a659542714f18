#include "render/known_answers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "cl/kernel_sources.hpp"
#include "cl/program.hpp"
#include "error.hpp"
#include "fresnel/fresnel.hpp"
#include "map/latlong.hpp"
#include "map/luminance.hpp"
#include "reference/display.hpp"
#include "reference/draw.hpp"
#include "reference/shade.hpp"
#include "reference/tables.hpp"
#include "sampling/stage3_sample.hpp"
#include "shading/display.hpp"
#include "shading/exact.hpp"
#include "shading/harmonic.hpp"
#include "shading/pixels.hpp"
#include "shading/shared.hpp"
#include "shading/stage4_per_pixel.hpp"
#include "tables/stage2_cdf.hpp"

namespace clerestory {
namespace {

constexpr std::size_t WIDTH = 16;
constexpr std::size_t HEIGHT = 8;
constexpr std::size_t SIDE = 9;     // pixels of a picture's side
constexpr std::size_t DRAWS = 256;  // of a shared set

// What float32 arithmetic of a few dozen steps may lose, and far less than any mistake makes.
constexpr double CLOSE = 1e-5;

constexpr double PI = std::numbers::pi;

/// The value of a texel's red component: black texels and a black row, values in all of 1 .. 8, and a sun.
float red_of(std::size_t row, std::size_t column) {
    if (row == 2 || (row + column) % 5 == 0) return 0;
    if (row == 5 && column == 11) return 1000;
    return static_cast<float>(1 + (7 * row + 3 * column) % 8);
}

/// A map of every kind of texel, its components as 1 to 2 to 4, times `scale`.
RadianceMap mixed_map(float scale) {
    RadianceMap map{WIDTH, HEIGHT, PageBuffer(3 * WIDTH * HEIGHT)};
    for (std::size_t i = 0; i < map.rgb.size(); ++i) {
        const std::size_t texel = i / 3;
        map.rgb[i] = red_of(texel / WIDTH, texel % WIDTH) * static_cast<float>(1U << (i % 3)) * scale;
    }
    return map;
}

/// Light of radiance 1 from the upper half of the sphere: the surface of normal n sees (1 + n.y) / 2 of it.
RadianceMap half_lit_sky() {
    RadianceMap map{WIDTH, HEIGHT, PageBuffer(3 * WIDTH * HEIGHT)};
    for (std::size_t i = 0; i < map.rgb.size(); ++i) map.rgb[i] = i < map.rgb.size() / 2 ? 1.0F : 0.0F;
    return map;
}

/// A map with its tables. Rows are not cut for several work-items, which would be other kernels.
struct Lit {
    Lit(const Device& device, RadianceMap lit)
        : map(std::move(lit)),
          on_device(device, map),
          distribution(TableBuilder(device).build(on_device, {.path = ScanPath::rows})) {}
    Lit(const Lit&) = delete;  // the device reads the map where it lies
    Lit& operator=(const Lit&) = delete;

    RadianceMap map;
    DeviceMap on_device;
    Distribution distribution;
};

bool far(double found, double expected, double tolerance = CLOSE) {
    return !(std::abs(found - expected) <= tolerance * std::max(1.0, std::abs(expected)));  // NaN is far
}

std::string wrong_tables(const Lit& lit) {
    const auto luminance = luminance_weights_f32(Luminance::average);
    const auto conditional = lit.distribution.conditional.download();
    const auto marginal = lit.distribution.marginal.download();
    std::vector<double> weight(HEIGHT);
    double total = 0;
    for (std::size_t row = 0; row < HEIGHT; ++row) {
        const auto table = reference::row_table({lit.map.rgb.data() + 3 * WIDTH * row, 3 * WIDTH}, luminance);
        if (!std::equal(table.end.begin(), table.end.end(), conditional.begin() + static_cast<long>(WIDTH * row)) &&
            table.lit != 0) {
            return fmt::format("the table of row {} is wrong", row);
        }
        weight[row] = std::ldexp(static_cast<double>(table.sum), table.exponent) *
                      static_cast<double>(reference::row_sine(row, HEIGHT));
        total += weight[row];
    }
    double end = 0;
    for (std::size_t row = 0; row < HEIGHT; ++row) {
        end += weight[row] / total;
        if (far(marginal[row] / static_cast<double>(TABLE_ONE), end)) {
            return fmt::format("row {} ends at {:.6f} of the light, not at {:.6f}", row,
                               marginal[row] / static_cast<double>(TABLE_ONE), end);
        }
    }
    return {};
}

/// Samples on the host.
struct Drawn {
    explicit Drawn(const SampleSet& set)
        : texel(set.texel.download()),
          direction(set.direction.download()),
          pdf(set.pdf.download()),
          radiance(set.radiance.download()) {}
    [[nodiscard]] std::array<double, 3> direction_of(std::size_t i) const {
        return {direction[i], direction[DRAWS + i], direction[2 * DRAWS + i]};
    }

    std::vector<cl_uint> texel;
    std::vector<cl_float> direction;
    std::vector<cl_float> pdf;
    std::vector<cl_float> radiance;
};

/// Whether a direction leads into a texel, by inverse functions, which no kernel uses.
bool leads_into(const std::array<double, 3>& w, std::size_t row, std::size_t column) {
    const double down = std::acos(std::clamp(w[1], -1.0, 1.0)) / PI * HEIGHT;
    const double turn = std::atan2(w[2], w[0]) / (2 * PI);
    const double along = (turn < 0 ? turn + 1 : turn) * WIDTH;
    const auto within = [](double place, std::size_t cell) {
        const double margin = 1e-3;  // of a texel: rounding at its edges, and near the poles
        return place >= static_cast<double>(cell) - margin && place <= static_cast<double>(cell + 1) + margin;
    };
    return within(down, row) && (within(along, column) || within(along - WIDTH, column));
}

std::string wrong_draws(const Lit& lit, const Drawn& drawn) {
    const auto probability = texel_probabilities(lit.distribution);
    std::size_t suns = 0;
    std::size_t sun = 0;
    for (std::size_t i = 1; i < probability.size(); ++i) {
        if (probability[i] > probability[sun]) sun = i;
    }
    for (std::size_t i = 0; i < DRAWS; ++i) {
        const std::size_t texel = drawn.texel[i];
        if (texel >= probability.size()) return fmt::format("sample {} lies beside the map", i);
        if (probability[texel] == 0) return fmt::format("sample {} lies in a black texel", i);
        const std::size_t row = texel / WIDTH;
        const auto w = drawn.direction_of(i);
        if (far(std::hypot(w[0], w[1], w[2]), 1) || !leads_into(w, row, texel % WIDTH)) {
            return fmt::format(
                "sample {} lies in row {}, column {}, and its direction ({:.4f}, {:.4f}, {:.4f}) leads elsewhere", i,
                row, texel % WIDTH, w[0], w[1], w[2]);
        }
        const double density = probability[texel] / static_cast<double>(reference::solid_angle(row, WIDTH, HEIGHT));
        if (far(drawn.pdf[i] / density, 1)) {
            return fmt::format("sample {} has the density {:.6g}, not {:.6g}", i, drawn.pdf[i], density);
        }
        for (std::size_t c = 0; c < 3; ++c) {
            if (drawn.radiance[c * DRAWS + i] != lit.map.rgb[3 * texel + c]) {
                return fmt::format("sample {} has another radiance than its texel", i);
            }
        }
        if (texel == sun) ++suns;
    }
    const double expected = probability[sun] * DRAWS;
    const double deviation = std::sqrt(expected * (1 - probability[sun]));
    if (std::abs(static_cast<double>(suns) - expected) > 6 * deviation) {  // one stream in 5e8 of sound ones
        return fmt::format("of {} samples, {} lie in the brightest texel, not about {:.0f}", DRAWS, suns, expected);
    }
    return {};
}

std::array<double, 3> normal_of(const std::vector<cl_float>& normals, std::size_t stride, std::size_t at) {
    return {normals[at], normals[stride + at], normals[2 * stride + at]};
}

/// The picture's pixels lit by these very samples, summed up in long double.
std::string wrong_shading(const Lit& lit, const Drawn& drawn, const SphereView& view,
                          std::vector<cl_float> unit_albedo_radiance) {
    std::vector<reference::Light> lights;
    for (std::size_t i = 0; i < DRAWS; ++i) {
        const auto w = drawn.direction_of(i);
        lights.push_back(reference::light_of_sample(
            {w[0], w[1], w[2]}, {drawn.radiance[i], drawn.radiance[DRAWS + i], drawn.radiance[2 * DRAWS + i]},
            drawn.pdf[i], DRAWS));
    }
    const auto pixels = view.pixel.download();
    const auto known = reference::sphere_pixels(SIDE);
    for (std::size_t at = 0; at < view.count; ++at) {
        const auto pixel =
            std::find_if(known.begin(), known.end(), [&](const auto& p) { return p.index == pixels[at]; });
        if (pixel == known.end()) return fmt::format("pixel {} is beside the sphere", pixels[at]);
        const auto expected = reference::shade(pixel->normal, lights);
        for (std::size_t c = 0; c < 3; ++c) {
            const double found = std::ldexp(unit_albedo_radiance[c * view.stride + at], lit.distribution.exponent);
            if (far(found, static_cast<double>(expected[c]))) {
                return fmt::format("pixel {} is {:.6g}, not {:.6g}", pixels[at], found,
                                   static_cast<double>(expected[c]));
            }
        }
    }
    return {};
}

std::string wrong_samples(const Device& device) {
    const Lit lit(device, mixed_map(1));
    if (auto wrong = wrong_tables(lit); !wrong.empty()) return wrong;
    Sampler sampler(device, lit.on_device, lit.distribution, {});
    const Drawn drawn(sampler.draw(DRAWS));
    if (auto wrong = wrong_draws(lit, drawn); !wrong.empty()) return wrong;
    const SphereView view(device, SIDE);
    auto unit_albedo_radiance = view.planes(device);
    SharedShader(device).shade(sampler, lit.distribution, view, DRAWS, unit_albedo_radiance);
    return wrong_shading(lit, drawn, view, unit_albedo_radiance.download());
}

/// A picture of the half-lit sky.
std::string wrong_sky(const SphereView& view, const std::vector<cl_float>& unit_albedo_radiance, int exponent,
                      double tolerance) {
    const auto normals = view.normal.download();
    for (std::size_t at = 0; at < view.count; ++at) {
        const double expected = (1 + normal_of(normals, view.stride, at)[1]) / 2;
        for (std::size_t c = 0; c < 3; ++c) {
            const double found = std::ldexp(unit_albedo_radiance[c * view.stride + at], exponent);
            if (far(found, expected, tolerance)) {
                return fmt::format("under a half-lit sky a pixel is {:.6g}, not {:.6g}", found, expected);
            }
        }
    }
    return {};
}

std::string wrong_integrals(const Device& device) {
    const Lit sky(device, half_lit_sky());
    const SphereView view(device, SIDE);
    auto unit_albedo_radiance = view.planes(device);
    if (device.traits().fp64) {
        ExactIntegrator(device).shade(sky.on_device, sky.distribution, 0, view, unit_albedo_radiance);
        auto wrong = wrong_sky(view, unit_albedo_radiance.download(), sky.distribution.exponent, CLOSE);
        if (!wrong.empty()) return "estimator exact: " + wrong;
    }
    // Of this sky, degrees 0 and 1 alone light a surface: a series of any degree has nothing to leave out.
    HarmonicShader harmonic(device);
    harmonic.shade(harmonic.project(sky.on_device, sky.distribution, {.degree = 4, .lights = 0}), 0, view,
                   unit_albedo_radiance);
    auto wrong = wrong_sky(view, unit_albedo_radiance.download(), sky.distribution.exponent, CLOSE);
    if (!wrong.empty()) return "estimator harmonic: " + wrong;
    // One sample of the cosine over its density has the variance 5/12 here: 64 of them a pixel stray by 0.08, and six
    // times that is allowed.
    PerPixelShader(device, sky.on_device, sky.distribution, {}).shade(view, 64, unit_albedo_radiance);
    wrong = wrong_sky(view, unit_albedo_radiance.download(), sky.distribution.exponent, 0.5);
    return wrong.empty() ? wrong : "estimator per-pixel: " + wrong;
}

std::string wrong_reflectance(const Device& device) {
    const FresnelCurves glass = fresnel_curves(device, {}, {0, 90});
    const std::array<double, 2> expected = {0.04, 1};
    for (std::size_t i = 0; i < expected.size(); ++i) {
        for (const auto* curve : {&glass.parallel, &glass.perpendicular, &glass.mean, &glass.schlick}) {
            if (far((*curve)[i], expected[i])) {
                return fmt::format("glass at {:.0f} degrees reflects {:.6g}, not {:.6g}", glass.angle_deg[i],
                                   (*curve)[i], expected[i]);
            }
        }
    }
    return {};
}

std::string wrong_preview(const Device& device) {
    const ToneOptions tone;
    const std::array<float, 3> values = {0, 0.5F, 2};
    const cl_uint found = Display(device).preview(values, 3, tone).at(0);
    for (std::size_t c = 0; c < values.size(); ++c) {
        const auto byte = static_cast<double>((found >> (8 * c)) & 0xFFU);
        const auto expected = static_cast<double>(reference::tone(values[c], tone.exposure, tone.gamma));
        if (std::abs(byte - expected) > 1) {
            return fmt::format("{} is shown as {:.0f}, not {:.1f}", values[c], byte, expected);
        }
    }
    return {};
}

std::string wrong_denormals(const Device& device) {
    if (!device.traits().denormals) return {};
    auto wrong = wrong_tables(Lit(device, mixed_map(0x1p-140F)));
    return wrong.empty() ? wrong : "with numbers below 2^-126, which the device says to keep, " + wrong;
}

// Goes up with every change of a question: what was answered before then counts no more.
constexpr int QUESTIONS = 1;

/// All that decides the answers: the programs' key over every kernel, and the layout of the work.
std::string key_of(const Device& device) {
    std::string sources;
    for (const auto& [name, text] : cl_source::all()) sources += text;
    const DeviceTraits& traits = device.traits();
    return fmt::format("known answers {}\n", QUESTIONS) +
           program_key(device, sources,
                       fmt::format("{:d}{:d} {}", traits.fat_items, traits.denormals, traits.scan_lanes));
}

// What the cache keeps: this, then what is wrong.
constexpr std::string_view ANSWERED = "answered ";

std::optional<std::string> remembered(const Device& device, const std::string& key) {
    auto kept = precompiled_program(key);
    if (!kept) kept = device.program_cache().load(key);
    if (!kept) return std::nullopt;
    const std::string text(kept->begin(), kept->end());
    if (!text.starts_with(ANSWERED)) return std::nullopt;
    return text.substr(ANSWERED.size());
}

}  // namespace

KnownAnswers ask_known_answers(const Device& device) {
    KnownAnswers answers;
    for (const auto& ask : {wrong_samples, wrong_integrals, wrong_reflectance, wrong_preview, wrong_denormals}) {
        try {
            answers.wrong = ask(device);
        } catch (const DeviceError& error) {
            if (answers.failed.empty()) answers.failed = error.what();
        }
        if (!answers.wrong.empty()) break;
    }
    return answers;
}

KnownAnswers known_answers(const Device& device) {
    const std::string key = key_of(device);
    const auto before = remembered(device, key);
    KnownAnswers answers = before ? KnownAnswers{*before, {}} : ask_known_answers(device);
    if (!answers.failed.empty()) return answers;  // another time it may answer
    const std::string text = std::string(ANSWERED) + answers.wrong;
    const std::vector<unsigned char> bytes(text.begin(), text.end());
    if (!before) device.program_cache().store(key, bytes);
    if (device.precompilation()) device.precompilation()->add(key, bytes);
    return answers;
}

Device open_device(const DeviceOptions& options, const DeviceHooks& hooks) {
    Device device(options, hooks);
    const std::string wrong = known_answers(device).wrong;
    if (!wrong.empty()) {
        const DeviceInfo& info = device.info();
        throw DeviceError(
            fmt::format("OpenCL device {} ({}, {}) gives wrong answers, so nothing is made with it: {}. Choose another "
                        "with --device, or install another version of its driver",
                        info.selector, info.name, info.version, wrong));
    }
    return device;
}

}  // namespace clerestory
