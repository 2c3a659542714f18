#include "samples.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>

#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"
#include "harmonic.hpp"

namespace clerestory {
namespace {

// As in kernels/stage3_sample.cl.
constexpr std::size_t DRAW_BLOCK = 256;

// Kernels know sequences by these numbers.
static_assert(static_cast<cl_uint>(Sequence::random) == SEQUENCE_RANDOM);
static_assert(static_cast<cl_uint>(Sequence::stratified) == SEQUENCE_STRATIFIED);
static_assert(static_cast<cl_uint>(Sequence::sobol) == SEQUENCE_SOBOL);

/// 2^64 / count, rounded down; 2^64 - 1 for a count of one.
cl_ulong step_of(std::size_t count) {
    constexpr cl_ulong LAST = ~cl_ulong{0};
    return LAST / count + (std::has_single_bit(count) && count > 1 ? 1 : 0);
}

struct SequenceName {
    Sequence sequence;
    const char* name;
};
constexpr std::array SEQUENCES = {SequenceName{Sequence::random, "random"},
                                  SequenceName{Sequence::stratified, "stratified"},
                                  SequenceName{Sequence::sobol, "sobol"}};

}  // namespace

std::vector<std::string> sequence_names() {
    std::vector<std::string> names;
    for (const auto& [value, name] : SEQUENCES) names.emplace_back(name);
    return names;
}

std::string sequence_name(Sequence sequence) {
    for (const auto& [value, name] : SEQUENCES) {
        if (value == sequence) return name;
    }
    return "unknown";
}

Sequence sequence_by_name(const std::string& wanted) {
    for (const auto& [value, name] : SEQUENCES) {
        if (name == wanted) return value;
    }
    throw UsageError(
        fmt::format("no sequence is named {}: choose one of {}", wanted, fmt::join(sequence_names(), ", ")));
}

std::vector<std::string> texel_place_names() {
    return {texel_place_name(TexelPlace::jitter), texel_place_name(TexelPlace::centre)};
}

std::string texel_place_name(TexelPlace place) { return place == TexelPlace::centre ? "centre" : "jitter"; }

TexelPlace texel_place_by_name(const std::string& wanted) {
    for (const TexelPlace place : {TexelPlace::jitter, TexelPlace::centre}) {
        if (texel_place_name(place) == wanted) return place;
    }
    throw UsageError(fmt::format("a sample lies in its texel by one of {}, not by {}",
                                 fmt::join(texel_place_names(), ", "), wanted));
}

namespace {

/// Compile-time choices that no map has a part in: a program with no others serves maps of every size.
std::string sampling_defines(const SamplingOptions& options) {
    return fmt::format("-DTEXEL_CENTRE={} -DGUIDED={} -DSEQUENCE={}u", options.place == TexelPlace::centre ? 1 : 0,
                       options.guided ? 1 : 0, static_cast<cl_uint>(options.sequence));
}

}  // namespace

std::string draw_defines(const Distribution& distribution, const SamplingOptions& options) {
    return fmt::format("-DROW_STEPS={} -DCOLUMN_STEPS={} {}", std::bit_width(distribution.height - 1),
                       std::bit_width(distribution.width - 1), sampling_defines(options));
}

Strata strata(std::size_t count) {
    const std::size_t points = std::max<std::size_t>(count, 1);
    const auto columns = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(points))));
    const std::size_t cells = points / columns;
    return {step_of(points), step_of(cells), step_of(cells + 1), narrow(points % columns * (cells + 1)), narrow(cells)};
}

float rotation_turns(double rotate_y_deg) {
    const double turns = rotate_y_deg / 360;
    return static_cast<float>(turns - std::floor(turns));
}

struct Sampler::State {
    State(const Device& opened, const DeviceMap& lit, const Distribution& drawn_from, const SamplingOptions& chosen)
        : device(opened), map(lit), distribution(drawn_from), options(chosen) {}

    const Device& device;
    const DeviceMap& map;
    const Distribution& distribution;
    SamplingOptions options;
    bool by_blocks = device.traits().fat_items && options.guided;
    Program program{device, "stage3_sample.cl",
                    by_blocks ? sampling_defines(options) : draw_defines(distribution, options)};
    Kernel<Uints, Uints, cl_uint, cl_uint, Uints, Uints, cl_uint, cl_uint, Buffer<RowFrame>, Floats, cl_float, cl_float,
           cl_uint, cl_uint, cl_uint, Strata, cl_uint, cl_uint, Uints, Floats, Floats, Floats>
        draw_samples{device, program, by_blocks ? "draw_blocks" : "draw_samples"};
    Kernel<Uints, Uints, cl_uint, cl_uint, Uints, Uints, cl_uint, cl_uint, Uints, cl_uint, Uints, Floats> locate_points{
        device, program, "locate_points"};
    std::optional<HarmonicLight> control;
};

Sampler::Sampler(const Device& device, const DeviceMap& map, const Distribution& distribution,
                 const SamplingOptions& options)
    : state_(std::make_unique<State>(device, map, distribution, options)) {
    if (distribution.black()) throw InputError("the map is black: there is nothing to draw samples from");
}
Sampler::Sampler(Sampler&&) noexcept = default;
Sampler& Sampler::operator=(Sampler&&) noexcept = default;
Sampler::~Sampler() = default;

void Sampler::reseed(std::uint64_t seed) noexcept { state_->options.seed = seed; }
void Sampler::rotate(double rotate_y_deg) noexcept { state_->options.rotate_y_deg = rotate_y_deg; }

const SamplingOptions& Sampler::options() const noexcept { return state_->options; }

const HarmonicLight& Sampler::control(HarmonicShader& shader) {
    State& s = *state_;
    if (!s.control) s.control = shader.project(s.map, s.distribution, {s.options.control_degree, 0});
    return *s.control;
}

SampleSet Sampler::allocate(std::size_t count) const {
    const Device& device = state_->device;
    SampleSet set;
    set.count = count;
    set.texel = Uints(device, "the samples' texels", count);
    set.direction = Floats(device, "the samples' directions", 3 * count);
    set.pdf = Floats(device, "the samples' densities", count);
    set.radiance = Floats(device, "the samples' radiances", 3 * count);
    return set;
}

SampleSet Sampler::draw(std::size_t count, std::size_t first, std::size_t total) {
    SampleSet set = allocate(count);
    draw_into(set, first, total);
    return set;
}

void Sampler::draw_into(SampleSet& set, std::size_t first, std::size_t total) {
    State& s = *state_;
    const Distribution& d = s.distribution;
    const Range range =
        s.by_blocks ? s.device.fat((set.count + DRAW_BLOCK - 1) / DRAW_BLOCK) : s.device.thin((set.count + 1) / 2);
    s.draw_samples(range, d.marginal, d.marginal_guide, narrow(d.height), d.row_bits, d.conditional,
                   d.conditional_guide, narrow(d.width), d.column_bits, d.frames, s.map.radiance,
                   static_cast<float>(1.0 / static_cast<double>(d.width)), rotation_turns(s.options.rotate_y_deg),
                   static_cast<cl_uint>(s.options.seed), static_cast<cl_uint>(s.options.seed >> 32), 0U,
                   strata(total == 0 ? first + set.count : total), narrow(first), narrow(set.count), set.texel,
                   set.direction, set.pdf, set.radiance);
}

Sampler::Located Sampler::locate(std::span<const cl_uint> points) {
    State& s = *state_;
    const Distribution& d = s.distribution;
    const std::size_t count = points.size() / 2;
    const Uints u(s.device, "the points", points);
    Uints texel(s.device, "the points' texels", count);
    Floats within(s.device, "the points' places", 2 * count);
    s.locate_points(s.device.thin(count), d.marginal, d.marginal_guide, narrow(d.height), d.row_bits, d.conditional,
                    d.conditional_guide, narrow(d.width), d.column_bits, u, narrow(count), texel, within);
    return {texel.download(), within.download()};
}

}  // namespace clerestory
