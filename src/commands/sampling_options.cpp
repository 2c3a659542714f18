#include "commands/sampling_options.hpp"

namespace clerestory::commands {

void add_draw_options(CLI::App& command, DrawOptions& options) {
    constexpr std::size_t LARGEST_COUNT = std::size_t{1} << 30;
    const char* group = "Samples";
    command.add_option("-n,--samples", options.counts, "Numbers of samples, such as 64,256,1024")
        ->delimiter(',')
        ->type_name("N[,N...]")
        ->check(CLI::Range(std::size_t{1}, LARGEST_COUNT))
        ->capture_default_str()
        ->group(group);
    command
        .add_option("--sequence", options.sequence,
                    "Where sample points come from; sobol is best where N is a power of two")
        ->check(CLI::IsMember(sequence_names()))
        ->capture_default_str()
        ->group(group);
    command.add_option("--texel", options.texel, "A sample lies anywhere in its texel, or at its centre")
        ->check(CLI::IsMember({"jitter", "centre"}))
        ->capture_default_str()
        ->group(group);
    command.add_flag("--plain-search", options.plain_search, "Search without guide tables; the results are the same")
        ->group(group);
}

void add_control_degree(CLI::App& command, unsigned& degree) {
    // At this degree the error of 32 samples a pixel falls 30 to 50 times on photographed maps, for a twentieth more
    // time.
    constexpr unsigned DEFAULT_CONTROL_DEGREE = 8;
    degree = DEFAULT_CONTROL_DEGREE;
    command
        .add_option("--control-degree", degree,
                    "Sample only what harmonics to this degree leave, which are known exactly; 0 samples everything")
        ->check(CLI::Range(0U, SamplingOptions::MAX_CONTROL_DEGREE))
        ->capture_default_str()
        ->group("Samples");
}

SamplingOptions sampling_of(const DrawOptions& options, const Common& common, double rotate_y) {
    SamplingOptions sampling;
    sampling.sequence = sequence_by_name(options.sequence);
    sampling.place = options.texel == "centre" ? TexelPlace::centre : TexelPlace::jitter;
    sampling.seed = common.seed;
    sampling.rotate_y_deg = rotate_y;
    sampling.guided = !options.plain_search;
    return sampling;
}

}  // namespace clerestory::commands
