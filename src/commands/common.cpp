#include "commands/common.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/atomic_file.hpp"
#include "base/clock.hpp"
#include "base/durable.hpp"
#include "base/json_text.hpp"
#include "base/output_check.hpp"
#include "base/standard_streams.hpp"
#include "base/text_escape.hpp"
#include "commands/caches.hpp"
#include "commands/validators.hpp"
#include "error.hpp"
#include "render/known_answers.hpp"

namespace clerestory::commands {

void add_common(CLI::App& command, Common& common, const std::string& example) {
    const char* group = "Every command";
    command.add_option("--json", common.json, "Write a JSON report to FILE, or to stdout with -")
        ->type_name("FILE|-")
        ->check(output_name())
        ->group(group);
    command.add_flag("-q,--quiet", common.quiet, "No messages but warnings and errors")->group(group);
    command.add_flag("-v,--verbose", common.verbose, "More messages: sizes, device, time by stage")->group(group);
    command
        .add_option("--device", common.device.selector,
                    "OpenCL platform and device by number; see `clerestory devices`")
        ->type_name("P:D")
        ->group(group);
    command.add_option("--threads", common.device.threads, "Compute units of the device to use; 0 is all of them")
        ->type_name("N")
        ->transform(whole_number(0, std::numeric_limits<unsigned>::max()))
        ->group(group);
    command
        .add_option("--work-group", common.device.work_group, "Work-items in a group; 0 is each kernel's own choice")
        ->type_name("N")
        ->transform(whole_number())
        ->group(group);
    // For tests: lays work out as for a device of another kind, on whatever device there is.
    command
        .add_option_function<std::string>(
            "--act-as", [&common](const std::string& name) { common.device.act_as = act_as_by_name(name); })
        ->take_last()
        ->group("");
    command.add_option("--seed", common.seed, "Seed of every random number; the same seed gives the same bits")
        ->type_name("N")
        ->transform(whole_number())
        ->capture_default_str()
        ->group(group);
    command.footer("\nExample:\n" + example);
}

DeviceOptions device_options(const Common& common) {
    const Caches& caches = prepare_caches();
    if (!caches.trouble.empty()) warn(common, caches.trouble);
    DeviceOptions options = common.device;
    options.program_cache = caches.programs;
    return options;
}

Device open_device(const Common& common) {
    // See cmake/precompile.cmake.
    return clerestory::open_device(device_options(common),
                                   {.precompile_into = folder_named_by("CLERESTORY_PRECOMPILE_DIR")});
}

void check_files(const Common& common, const std::vector<std::filesystem::path>& inputs,
                 std::vector<std::filesystem::path> outputs) {
    outputs.emplace_back(common.json);
    check_outputs(inputs, outputs);
}

void emit_json(const Common& common, const nlohmann::json& report) {
    sync_remembered();  // the report says that the other files are there
    if (common.json.empty()) return;
    const std::string text = json_text(report);
    if (common.json != "-") {
        std::fflush(stdout);  // the file may be what stdout is
        write_text(common.json, text);
        return;
    }
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
        throw OutputError("the JSON report could not be written to stdout");
    }
}

void say(const Common& common, const std::string& line) {
    if (!common.quiet) print_to_stderr(one_line(line) + "\n");
}

void detail(const Common& common, const std::string& line) {
    if (common.verbose) print_to_stderr(one_line(line) + "\n");
}

void warn(const Common& /*common*/, const std::string& line) { print_to_stderr("warning: " + one_line(line) + "\n"); }

Progress::Progress(const Common& common, std::string title)
    : title_(std::move(title)), shown_(!common.quiet && isatty(STDERR_FILENO) == 1), started_(seconds_now()) {}

Progress::~Progress() {
    if (dirty_) print_to_stderr("\r\033[K");
}

void Progress::update(double done, double total) {
    constexpr double QUIET_SECONDS = 1;     // shorter work needs no bar
    constexpr double REDRAW_SECONDS = 0.1;  // faster than this only costs
    constexpr int WIDTH = 30;
    const double now = seconds_now();
    if (!shown_ || now - started_ < QUIET_SECONDS || now - drawn_ < REDRAW_SECONDS || total <= 0) return;
    drawn_ = now;
    dirty_ = true;
    const double share = std::clamp(done / total, 0.0, 1.0);
    const auto filled = static_cast<std::size_t>(share * WIDTH);
    const double left = share > 0 ? (now - started_) * (1 - share) / share : 0;
    print_to_stderr(fmt::format("\r\033[K{} [{}{}] {:3.0f} %  {:.0f} s left", title_, std::string(filled, '#'),
                                std::string(WIDTH - filled, ' '), 100 * share, left));
}

}  // namespace clerestory::commands
