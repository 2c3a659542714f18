#include "sampling/stage3_sample.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/named_values.hpp"
#include "cl/kernel.hpp"
#include "cl/program.hpp"
#include "cl/shared_kernel_types.hpp"

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

const NamedValues<Sequence>& sequences() {
    static const NamedValues<Sequence> all(
        "sequence", {{Sequence::random, "random"}, {Sequence::stratified, "stratified"}, {Sequence::sobol, "sobol"}});
    return all;
}

const NamedValues<TexelPlace>& texel_places() {
    static const NamedValues<TexelPlace> all("place in the texel",
                                             {{TexelPlace::jitter, "jitter"}, {TexelPlace::centre, "centre"}});
    return all;
}

/// Compile-time choices that no map has a part in: a program with no others serves maps of every size.
std::string sampling_defines(const SamplingOptions& options, Search search) {
    return fmt::format("-DTEXEL_CENTRE={} -DGUIDED={} -DSEQUENCE={}u", options.place == TexelPlace::centre ? 1 : 0,
                       search == Search::guided ? 1 : 0, static_cast<cl_uint>(options.sequence));
}

}  // namespace

std::vector<std::string> sequence_names() { return sequences().names(); }
std::string sequence_name(Sequence sequence) { return sequences().name_of(sequence); }
Sequence sequence_by_name(const std::string& name) { return sequences().by_name(name); }

std::vector<std::string> texel_place_names() { return texel_places().names(); }
std::string texel_place_name(TexelPlace place) { return texel_places().name_of(place); }
TexelPlace texel_place_by_name(const std::string& name) { return texel_places().by_name(name); }

float map_scale(const Distribution& distribution) { return std::ldexp(1.0F, -distribution.exponent); }

float sample_share(std::size_t count) {
    return static_cast<float>(1 / (std::numbers::pi * static_cast<double>(count)));
}

std::string draw_defines(const Distribution& distribution, const SamplingOptions& options, Search search) {
    return fmt::format("-DROW_STEPS={} -DCOLUMN_STEPS={} {}", std::bit_width(distribution.height - 1),
                       std::bit_width(distribution.width - 1), sampling_defines(options, search));
}

Strata strata(std::size_t count) {
    const std::size_t points = std::max<std::size_t>(count, 1);
    const auto columns = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(points))));
    const std::size_t cells = points / columns;
    return {step_of(points), step_of(cells), step_of(cells + 1), narrow(points % columns * (cells + 1)), narrow(cells)};
}

DrawSettings draw_settings(const Distribution& distribution, const SamplingOptions& options, std::size_t count) {
    const double turns = options.rotate_y_deg / 360;
    return {narrow(distribution.width),
            narrow(distribution.height),
            distribution.row_bits,
            distribution.column_bits,
            static_cast<float>(1.0 / static_cast<double>(distribution.width)),
            static_cast<float>(turns - std::floor(turns)),
            static_cast<cl_uint>(options.seed),
            static_cast<cl_uint>(options.seed >> 32),
            strata(count)};
}

struct Sampler::State {
    State(const Device& opened, const DeviceMap& lit, const Distribution& drawn_from, const SamplingOptions& chosen,
          Search by)
        : device(opened), map(lit), distribution(drawn_from), options(chosen), search(by) {}

    const Device& device;
    const DeviceMap& map;
    const Distribution& distribution;
    SamplingOptions options;
    Search search;
    bool by_blocks = device.traits().fat_items && search == Search::guided;
    Program program{device, "stage3_sample.cl",
                    by_blocks ? sampling_defines(options, search) : draw_defines(distribution, options, search)};
    Kernel<Uints, Uints, Uints, Uints, Buffer<RowFrame>, Floats, DrawSettings, cl_uint, cl_uint, Uints, Floats, Floats,
           Floats>
        draw_samples{device, program, by_blocks ? "draw_blocks" : "draw_samples"};
    Kernel<Uints, Uints, Uints, Uints, DrawSettings, Uints, cl_uint, Uints, Floats> locate_points{device, program,
                                                                                                  "locate_points"};
};

Sampler::Sampler(const Device& device, const DeviceMap& map, const Distribution& distribution,
                 const SamplingOptions& options, Search search)
    : state_(std::make_unique<State>(device, map, distribution, options, search)) {
    if (distribution.black()) throw InputError("the map is black: there is nothing to draw samples from");
}
Sampler::Sampler(Sampler&&) noexcept = default;
Sampler& Sampler::operator=(Sampler&&) noexcept = default;
Sampler::~Sampler() = default;

void Sampler::reseed(std::uint64_t seed) noexcept { state_->options.seed = seed; }
void Sampler::rotate(double rotate_y_deg) noexcept { state_->options.rotate_y_deg = rotate_y_deg; }

const SamplingOptions& Sampler::options() const noexcept { return state_->options; }

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
    s.draw_samples(range, d.marginal, d.marginal_guide, d.conditional, d.conditional_guide, d.frames, s.map.radiance,
                   draw_settings(d, s.options, total == 0 ? first + set.count : total), narrow(first),
                   narrow(set.count), set.texel, set.direction, set.pdf, set.radiance);
}

Sampler::Located Sampler::locate(std::span<const cl_uint> points) {
    State& s = *state_;
    const Distribution& d = s.distribution;
    const std::size_t count = points.size() / 2;
    const Uints u(s.device, "the points", points);
    Uints texel(s.device, "the points' texels", count);
    Floats within(s.device, "the points' places", 2 * count);
    s.locate_points(s.device.thin(count), d.marginal, d.marginal_guide, d.conditional, d.conditional_guide,
                    draw_settings(d, s.options, count), u, narrow(count), texel, within);
    return {texel.download(), within.download()};
}

}  // namespace clerestory
