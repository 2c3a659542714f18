#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "commands/map_options.hpp"
#include "commands/validators.hpp"
#include "comparison.hpp"
#include "image.hpp"

namespace clerestory::commands {
namespace {

struct CompareOptions {
    Common common;
    std::string picture;
    std::string reference;
    ReadOptions read_picture_as;
    ReadOptions read_reference_as;
    double max_rel_rmse = std::numeric_limits<double>::infinity();
};

/// JSON has no infinity: null stands for it.
nlohmann::json number_or_null(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(); }

Picture read(const std::string& file, const ReadOptions& options, const Common& common) {
    Picture picture = read_picture(file, options);
    // 8-bit previews may well be compared: their range is the subject, not a loss.
    std::erase_if(picture.source.notes, [](const MapNote& note) { return note.id == "eight_bit"; });
    warn_of_source(picture.source, file, common);
    return picture;
}

void run(const CompareOptions& options) {
    check_files(options.common, {options.picture, options.reference});
    const Picture picture = read(options.picture, options.read_picture_as, options.common);
    const Picture reference = read(options.reference, options.read_reference_as, options.common);
    const Comparison result = compare(picture, reference);
    const nlohmann::json report = {{"picture", options.picture},
                                   {"picture_source", describe_source(picture.source)},
                                   {"reference", options.reference},
                                   {"reference_source", describe_source(reference.source)},
                                   {"pixels", result.pixels},
                                   {"rmse", result.rmse},
                                   {"rel_rmse", number_or_null(result.rel_rmse)},
                                   {"bias", result.bias},
                                   {"rel_bias", number_or_null(result.rel_bias)},
                                   {"max_abs", result.max_abs},
                                   {"psnr", number_or_null(result.psnr)},
                                   {"reference_mean", result.reference_mean}};
    if (options.common.json != "-") {
        fmt::print(
            "pixels    {}\nrmse      {:.6g}\nrel rmse  {:.6g}\nbias      {:.6g}\nrel bias  {:.6g}\nmax abs   "
            "{:.6g}\npsnr      {:.2f} dB\n",
            result.pixels, result.rmse, result.rel_rmse, result.bias, result.rel_bias, result.max_abs, result.psnr);
    }
    emit_json(options.common, report);
    if (!(result.rel_rmse <= options.max_rel_rmse)) {
        throw Mismatch(fmt::format("{} differs from {}: relative RMSE {:.6g}, more than {:.6g}", options.picture,
                                   options.reference, result.rel_rmse, options.max_rel_rmse));
    }
}

}  // namespace

void add_compare(CLI::App& app) {
    auto* command = app.add_subcommand("compare", "Error of one picture against another, the reference");
    auto options = std::make_shared<CompareOptions>();
    command->add_option("A", options->picture, "The picture")->required();
    command->add_option("B", options->reference, "The reference")->required();
    command->add_option("--max-rel-rmse", options->max_rel_rmse, "Exit 1 where the relative RMSE is larger")
        ->type_name("X")
        ->check(finite_between(0, std::numeric_limits<double>::max()));
    add_layer_options(*command, options->read_picture_as.layer, options->read_picture_as.part, "the picture");
    add_layer_options(*command, options->read_reference_as.layer, options->read_reference_as.part, "the reference",
                      "reference-");
    add_common(*command, options->common, "  clerestory compare sphere.exr exact.exr --max-rel-rmse 0.02");
    command->callback([options] { run(*options); });
}

}  // namespace clerestory::commands
