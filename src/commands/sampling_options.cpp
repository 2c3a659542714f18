#include "commands/sampling_options.hpp"

#include "commands/validators.hpp"

#include "render/picture_limits.hpp"
#include "render/picture_recipe.hpp"
#include "tables/table_arithmetic.hpp"

namespace clerestory::commands {

void add_draw_options(CLI::App& command, DrawOptions& options) {
    const char* group = "Samples";
    command.add_option("-n,--samples", options.counts, "Numbers of samples, such as 64,256,1024")
        ->delimiter(',')
        ->type_name("N[,N...]")
        ->transform(whole_number(1, limits::LARGEST_COUNT))
        ->capture_default_str()
        ->group(group);
    command
        .add_option("--sequence", options.sequence,
                    "Where sample points come from; sobol is best where N is a power of two")
        ->check(one_of(sequence_names()))
        ->capture_default_str()
        ->group(group);
    command.add_option("--texel", options.texel, "A sample lies anywhere in its texel, or at its centre")
        ->check(one_of(texel_place_names()))
        ->capture_default_str()
        ->group(group);
    command
        .add_option("--table-arithmetic", options.table_arithmetic,
                    "Arithmetic of the sampling tables; integer is exact, the others show what they lose")
        ->check(one_of(table_arithmetic_names()))
        ->capture_default_str()
        ->group(group);
}

void add_control_degree(CLI::App& command, unsigned& degree) {
    degree = DEFAULT_CONTROL_DEGREE;
    command
        .add_option("--control-degree", degree,
                    "Sample only what harmonics to this degree leave, which are known exactly; 0 samples everything")
        ->transform(whole_number(0, SamplingOptions::MAX_CONTROL_DEGREE))
        ->capture_default_str()
        ->group("Samples");
}

SamplingOptions sampling_of(const DrawOptions& options, const Common& common, double rotate_y) {
    SamplingOptions sampling;
    sampling.sequence = sequence_by_name(options.sequence);
    sampling.place = texel_place_by_name(options.texel);
    sampling.seed = common.seed;
    sampling.rotate_y_deg = rotate_y;
    return sampling;
}

}  // namespace clerestory::commands
