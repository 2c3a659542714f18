#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cstdio>
#include <optional>
#include <string>

#include "ceilings.hpp"
#include "harness.hpp"

namespace clerestory::bench {
namespace {

/// `value` with a prefix of thousands.
std::string scaled(double value) {
    constexpr double THOUSAND = 1e3;
    for (const char* prefix : {"", " k", " M", " G", " T"}) {
        if (value < THOUSAND) return fmt::format("{:.3g}{}", value, prefix);
        value /= THOUSAND;
    }
    return fmt::format("{:.3g} P", value);
}

/// Why a run failed, if it did. Google Benchmark 1.8 gave the fields other names.
template <typename Run>
std::optional<std::string> failure_of(const Run& run) {
    if constexpr (requires { run.skip_message; }) {
        if (run.skipped) return run.skip_message;
    } else {
        if (run.error_occurred) return run.error_message;
    }
    return std::nullopt;
}

/// One Markdown table of all results.
class TableReporter : public benchmark::BenchmarkReporter {
  public:
    bool ReportContext(const Context&) override {
        fmt::print("| benchmark | cores | wall ms | kernels ms | processor ms | a second | of ceiling | target |\n");
        fmt::print("|---|---|---|---|---|---|---|---|\n");
        return true;
    }

    void ReportRuns(const std::vector<Run>& runs) override {
        for (const Run& run : runs) {
            if (const auto why = failure_of(run)) {
                fmt::print("| `{}` | failed: {} |\n", run.benchmark_name(), *why);
                continue;
            }
            const auto counter = [&](const char* name, auto format) -> std::string {
                const auto found = run.counters.find(name);
                return found == run.counters.end() ? "" : format(found->second.value);
            };
            const auto three = [](double value) { return fmt::format("{:.3g}", value); };
            const auto of_one = [](double value) { return fmt::format("{:.2f}", value); };
            fmt::print("| `{}` | {} | {} | {} | {} | {} {} | {} | {} |\n", name_of(run), counter("cores", three),
                       counter("ms", three), counter("kernel_ms", three), counter("processor_ms", three),
                       counter("rate", scaled), run.report_label, counter("of_ceiling", of_one),
                       counter("target_of_ceiling", of_one) + counter("target_rate", scaled));
            std::fflush(stdout);
        }
    }

  private:
    static std::string name_of(const Run& run) {
        const auto& name = run.run_name;
        return name.args.empty() || name.args.rfind("cores:", 0) == 0 ? name.function_name
                                                                      : name.function_name + "/" + name.args;
    }
};

void add_context() {
    constexpr double GIGA = 1e9;
    const auto& info = device_of(all_cores()).info();
    benchmark::AddCustomContext("device", info.name);
    benchmark::AddCustomContext("opencl", info.version);
    benchmark::AddCustomContext("compiler", CLERESTORY_COMPILER);
    benchmark::AddCustomContext("version", CLERESTORY_VERSION);
    for (unsigned cores = 1; cores <= all_cores(); cores += all_cores() - 1) {
        benchmark::AddCustomContext(
            fmt::format("ceilings_{}_cores", cores),
            fmt::format("copy {:.1f} GB/s, multiply-add {:.0f} Gflop/s, gather from 8 MiB {:.0f} M/s",
                        copy_bandwidth(cores) / GIGA, multiply_add_rate(cores) / GIGA,
                        gather_rate(cores, std::size_t{8} << 20) * 1e3 / GIGA));
        if (all_cores() == 1) break;
    }
}

}  // namespace
}  // namespace clerestory::bench

int main(int argc, char** argv) {
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    clerestory::bench::add_context();
    clerestory::bench::TableReporter reporter;
    benchmark::RunSpecifiedBenchmarks(&reporter);
    benchmark::Shutdown();
    return 0;
}
