#include "fresnel/fresnel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/atomic_file.hpp"
#include "base/clock.hpp"
#include "base/json_text.hpp"
#include "base/text_escape.hpp"
#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "commands/validators.hpp"
#include "error.hpp"
#include "fresnel/fresnel_report.hpp"

namespace clerestory::commands {
namespace {

namespace fs = std::filesystem;

constexpr const char* PLOT_NAME = "fresnel";

struct Options {
    Common common;
    Media media;
    unsigned steps = 901;  // a tenth of a degree
    std::vector<double> angles;
    std::vector<std::string> outputs;
};

void check_suffix(const std::string& output) {
    const std::string suffix = suffix_of(output);
    if (suffix == ".svg" || suffix == ".png" || suffix == ".csv" || suffix == ".json") return;
    throw UsageError(fmt::format("-o {}: curves are written as .svg, .png, .csv or .json", output));
}

/// --angles in ascending order and each once, or else the even grid of --steps.
std::vector<double> chosen_angles(const Options& options) {
    if (options.angles.empty()) return incidence_angles(options.steps);
    auto angles = options.angles;
    std::sort(angles.begin(), angles.end());
    angles.erase(std::unique(angles.begin(), angles.end()), angles.end());
    return angles;
}

void print(const FresnelFacts& facts) {
    fmt::print("R0                       {:.7g}\n", facts.r0);
    fmt::print("Brewster's angle         {:.5f} degrees\n", facts.brewster_deg);
    if (facts.critical_deg) {
        fmt::print("critical angle           {:.5f} degrees\n", *facts.critical_deg);
    } else {
        fmt::print("critical angle           none\n");
    }
    const auto line = [](const char* label, const SchlickError& worst) {
        fmt::print("{} {:.6g} at {:.3f} degrees\n", label, worst.error, worst.angle_deg);
    };
    line("Schlick, absolute error ", facts.max_abs);
    if (facts.max_rel) line("Schlick, relative error ", *facts.max_rel);
}

void write_output(const std::string& output, const plot::Plot& plot, const FresnelCurves& curves,
                  const nlohmann::json& report) {
    const std::string suffix = suffix_of(output);
    if (suffix == ".csv") return write_text(output, fresnel_csv(curves));
    if (suffix == ".json") return write_text(output, json_text(report));
    plot::write(output, plot);
}

void run(const Options& options) {
    for (const auto& output : options.outputs) check_suffix(output);
    check_files(options.common, {}, {options.outputs.begin(), options.outputs.end()});
    check(options.media);
    auto angles = chosen_angles(options);
    const Stopwatch watch;
    const Device device = open_device(options.common);
    detail(options.common, fmt::format("device {}, {} arithmetic", device.info().name,
                                       device.info().has_fp64 ? "double" : "pairs of floats"));
    const auto curves = fresnel_curves(device, options.media, std::move(angles));
    const auto facts = fresnel_facts(options.media);
    detail(options.common, fmt::format("{} angles in {:.3f} s", curves.angle_deg.size(), watch.seconds()));
    const auto report = fresnel_json(options.media, facts, curves);
    const auto plot = fresnel_plot(PLOT_NAME, options.media, facts, curves);
    for (const auto& output : options.outputs) {
        write_output(output, plot, curves, report);
        detail(options.common, "wrote " + output);
    }
    if (options.common.json != "-" && !options.common.quiet) print(facts);
    emit_json(options.common, report);
}

}  // namespace

void add_fresnel(CLI::App& app) {
    auto* command =
        app.add_subcommand("fresnel", "Plot the reflectance of a smooth dielectric against incidence angle");
    auto options = std::make_shared<Options>();
    command->add_option("--ior-incident", options->media.ior_incident, "Refractive index on the light's side")
        ->type_name("N")
        ->capture_default_str();
    command->add_option("--ior-transmitted", options->media.ior_transmitted, "Refractive index on the other side")
        ->type_name("N")
        ->capture_default_str();
    auto* steps = command->add_option("--steps", options->steps, "Angles from 0 to 90 degrees, both included")
                      ->type_name("N")
                      ->transform(whole_number(MIN_FRESNEL_STEPS, MAX_FRESNEL_STEPS))
                      ->capture_default_str();
    command->add_option("--angles", options->angles, "These incidence angles in degrees, in place of --steps")
        ->type_name("A,B,...")
        ->delimiter(',')
        ->excludes(steps);
    command->add_option("-o,--output", options->outputs, "File to write: .svg, .png, .csv or .json; may repeat")
        ->type_name("FILE")
        ->expected(1)
        ->check(output_name())
        ->take_all();
    add_common(*command, options->common,
               "  clerestory fresnel --ior-incident 1 --ior-transmitted 1.5 -o glass.svg -o glass.csv\n"
               "  clerestory fresnel --ior-incident 1.5 --ior-transmitted 1 --json -");
    command->callback([options] { run(*options); });
}

}  // namespace clerestory::commands
