#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "base/clock.hpp"
#include "base/text_escape.hpp"
#include "commands/commands.hpp"
#include "commands/common.hpp"
#include "commands/map_options.hpp"
#include "commands/validators.hpp"
#include "error.hpp"
#include "inspect.hpp"
#include "tables/table_arithmetic.hpp"

namespace clerestory::commands {
namespace {

constexpr double GIGA = 1e9;
// Bytes that the table build moves a texel: three floats in, one count out.
constexpr double BYTES_PER_TEXEL = 16;

struct InfoOptions {
    Common common;
    MapOptions map;
    std::vector<std::string> arithmetics;
};

nlohmann::json place_of(const TexelCount& found) {
    if (found.count == 0) return nullptr;
    return {{"row", found.row}, {"column", found.column}};
}

std::string place_text(const TexelCount& found) {
    return found.count == 0 ? "" : fmt::format(", first at row {}, column {}", found.row, found.column);
}

std::string source_text(const nlohmann::json& source) {
    const auto layer = source["layer"].get<std::string>();
    return one_line(fmt::format("{} of {}part {} of {}, {}, compression {}",
                                fmt::join(source["channels"].get<std::vector<std::string>>(), ", "),
                                layer.empty() ? "" : fmt::format("layer {}, ", layer), source["part"].get<int>(),
                                source["format"].get<std::string>(), source["type"].get<std::string>(),
                                source["compression"].get<std::string>()));
}

void print(const MapFacts& facts, const nlohmann::json& report) {
    fmt::print("map              {}\n", one_line(report["file"].get<std::string>()));
    fmt::print("lit by           {}\n", source_text(report["source"]));
    fmt::print("size             {} x {}\n", report["width"].get<std::size_t>(), report["height"].get<std::size_t>());
    fmt::print("integral Phi     {:.9g}\n", facts.phi);
    fmt::print("mean R, G, B     {:.6g}, {:.6g}, {:.6g}\n", facts.mean_rgb[0], facts.mean_rgb[1], facts.mean_rgb[2]);
    fmt::print("max intensity    {:.6g} at row {}, column {}\n", facts.max_intensity, facts.max_row, facts.max_column);
    fmt::print("dynamic range    {:.1f} stops\n", facts.stops());
    fmt::print("NaN              {}{}\n", facts.nan.count, place_text(facts.nan));
    fmt::print("infinite         {}{}\n", facts.inf.count, place_text(facts.inf));
    fmt::print("negative         {}{}\n", facts.negative.count, place_text(facts.negative));
    fmt::print("zero             {}{}\n", facts.zero.count, place_text(facts.zero));
    if (report["ringing"].get<std::uint64_t>() != 0) {
        fmt::print("ringing          {} values below 0 left by lossy compression, read as 0\n",
                   report["ringing"].get<std::uint64_t>());
    }
    if (!report["build_seconds"].is_null()) {
        fmt::print("undrawable f32   {} lit texels that a float32 running sum could never draw\n",
                   report["undrawable_f32"].get<std::uint64_t>());
        fmt::print("table build      {:.4f} s, {:.2f} GB/s, kernels warm\n", report["build_seconds"].get<double>(),
                   report["build_gb_per_second"].get<double>());
    }
}

/// How each asked arithmetic of tables does on the map.
nlohmann::json arithmetic_facts(const InfoOptions& options, const Device& device, const Scene& scene) {
    nlohmann::json facts = nlohmann::json::array();
    for (const std::string& name : options.arithmetics) {
        const ArithmeticReport found = measure_table_arithmetic(device, scene.device_map(), luminance_of(options.map),
                                                                table_arithmetic_by_name(name));
        facts.push_back({{"arithmetic", name},
                         {"lit", found.lit},
                         {"undrawable", found.undrawable},
                         {"largest_relative_error", found.largest_relative_error},
                         {"total_variation", found.total_variation},
                         {"total_relative_error", found.total_relative_error},
                         {"seconds", found.seconds}});
    }
    return facts;
}

void print_arithmetics(const nlohmann::json& facts) {
    if (facts.empty()) return;
    fmt::print("\n{:<16} {:>10} {:>16} {:>12} {:>12}\n", "arithmetic", "lit lost", "worst texel", "sum", "seconds");
    for (const auto& fact : facts) {
        fmt::print("{:<16} {:>10} {:>16.3g} {:>12.3g} {:>12.4f}\n", fact["arithmetic"].get<std::string>(),
                   fact["undrawable"].get<std::uint64_t>(), fact["largest_relative_error"].get<double>(),
                   fact["total_relative_error"].get<double>(), fact["seconds"].get<double>());
    }
    fmt::print(
        "lit lost: lit texels that are never drawn; worst texel: largest relative error of a lit texel's\n"
        "probability; sum: relative error of the weights' sum.\n");
}

/// Adds what only the tables of a usable map can tell.
void add_table_facts(nlohmann::json& report, const InfoOptions& options, const Device& device, TableBuilder& builder,
                     const Scene& scene) {
    const TableOptions tables{.luminance = luminance_of(options.map)};
    Distribution again = builder.build(scene.device_map(), tables);
    const Stopwatch watch;
    again = builder.build(scene.device_map(), tables, std::move(again));
    const double seconds = watch.seconds();
    const auto texels = static_cast<double>(scene.map().width * scene.map().height);
    report["device"] = device.info().name;
    report["build_seconds"] = seconds;
    report["build_first_seconds"] = scene.build_seconds();
    report["undrawable_f32"] = undrawable_f32(device, scene.device_map(), tables.luminance);
    report["build_gb_per_second"] = texels * BYTES_PER_TEXEL / seconds / GIGA;
    report["table_arithmetic"] = arithmetic_facts(options, device, scene);
}

nlohmann::json map_report(const InfoOptions& options, const RadianceMap& map, const MapFacts& facts) {
    nlohmann::json report = describe_map(options.map, map);
    report["phi"] = facts.phi;
    report["mean_rgb"] = facts.mean_rgb;
    report["max_intensity"] = facts.max_intensity;
    report["max_place"] = {{"row", facts.max_row}, {"column", facts.max_column}};
    report["min_lit_intensity"] = facts.min_intensity;
    report["dynamic_range_stops"] = facts.stops();
    report["nan"] = facts.nan.count;
    report["inf"] = facts.inf.count;
    report["negative"] = facts.negative.count;
    report["zero"] = facts.zero.count;
    report["ringing"] = map.ringing;
    report["first"] = {{"nan", place_of(facts.nan)},
                       {"inf", place_of(facts.inf)},
                       {"negative", place_of(facts.negative)},
                       {"zero", place_of(facts.zero)}};
    report["table_arithmetic"] = nlohmann::json::array();
    report["undrawable_f32"] = nullptr;
    report["build_seconds"] = nullptr;
    return report;
}

void run(const InfoOptions& options) {
    check_files(options.common, {map_file(options.map)});
    say_which_map(options.map, options.common);
    RadianceMap map = read_map_of(options.map);
    const MapSource source = map.source;
    const MapFacts facts = inspect(map, luminance_of(options.map));
    nlohmann::json report = map_report(options, map, facts);
    const bool usable = facts.bad() == 0 || options.map.bad_texels == "zero";
    if (usable) {
        const Device device = open_device(options.common);
        TableBuilder builder(device);
        const auto scene = make_scene(std::move(map), device, builder, options.map, options.common);
        add_table_facts(report, options, device, builder, *scene);
    }
    if (options.common.json != "-") {
        print(facts, report);
        print_arithmetics(report["table_arithmetic"]);
    }
    emit_json(options.common, report);
    if (!usable) {
        warn_of_source(source, map_file(options.map).string(), options.common);
        throw InputError(fmt::format("{}: {} NaN, {} infinite and {} negative texels; --bad-texels zero blackens them",
                                     map_file(options.map).string(), facts.nan.count, facts.inf.count,
                                     facts.negative.count));
    }
}

}  // namespace

void add_info(CLI::App& app) {
    auto* command = app.add_subcommand("info", "Pre-flight: what a map holds and what is hard about it");
    auto options = std::make_shared<InfoOptions>();
    add_map_options(*command, options->map);
    command
        ->add_option(
            "--table-arithmetic", options->arithmetics,
            "Build the sampling tables in these arithmetics too, such as f32,f32-compensated,f64,integer, and\n"
            "measure what each loses")
        ->delimiter(',')
        ->type_name("NAME[,NAME...]")
        ->check(one_of(table_arithmetic_names()));
    add_common(*command, options->common,
               "  clerestory info studio.exr\n  clerestory info studio.exr --table-arithmetic f32,f64,integer\n  "
               "clerestory info studio.exr --json -\n\n"
               "A map with NaN, infinite or negative texels is reported and ends with exit code 3.");
    command->callback([options] { run(*options); });
}

}  // namespace clerestory::commands
