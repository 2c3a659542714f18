#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cl/device.hpp"

namespace clerestory::commands {

/// Flags that every command has.
struct Common {
    std::string json;  ///< file for the JSON report, "-" for stdout, empty for none
    bool quiet = false;
    bool verbose = false;
    DeviceOptions device;
    std::uint64_t seed = 1;
};

/// Adds --json, -q, -v, --device, --threads, --work-group and --seed, and `example` at the end of the help text.
void add_common(CLI::App& command, Common& common, const std::string& example);

/// The device that these flags choose, opened with caches that can be written. Throws as clerestory::open_device.
Device open_device(const Common& common);
/// The same options for whoever opens the device; warns where caches are not where they are looked for.
DeviceOptions device_options(const Common& common);

/// Refuses --json, and other files that a command will write, where they would replace a file that it reads or one
/// another: before any work. Throws UsageError.
void check_files(const Common& common, const std::vector<std::filesystem::path>& inputs,
                 std::vector<std::filesystem::path> outputs = {});

/// Writes the report where --json says, whole or not at all; nothing without --json.
void emit_json(const Common& common, const nlohmann::json& report);

/// A line on stderr unless --quiet.
void say(const Common& common, const std::string& line);
/// A line on stderr only with --verbose.
void detail(const Common& common, const std::string& line);
/// A line on stderr always: results may not be what was wanted.
void warn(const Common& common, const std::string& line);

/// A bar on stderr for work that takes over a second; silent where stderr is no terminal or with --quiet.
class Progress {
  public:
    Progress(const Common& common, std::string title);
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    ~Progress();

    /// Draws the bar at `done` of `total`, at most ten times a second.
    void update(double done, double total);

  private:
    std::string title_;
    bool shown_;
    double started_;
    double drawn_ = 0;
    bool dirty_ = false;
};

}  // namespace clerestory::commands
