#include "base/available_memory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t UNBOUNDED = std::numeric_limits<std::size_t>::max();

/// The number after `key` in a file of "key value" lines.
std::optional<std::size_t> value_of(const fs::path& file, std::string_view key) {
    std::ifstream in(file);
    std::string word;
    while (in >> word) {
        std::size_t value = 0;
        if (word == key && in >> value) return value;
        in.clear();
        in.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
    }
    return std::nullopt;
}

/// The one number of a control file; nothing where it says "max" or is missing.
std::optional<std::size_t> sole_number(const fs::path& file) {
    std::ifstream in(file);
    std::size_t value = 0;
    if (in >> value) return value;
    return std::nullopt;
}

struct Controller {
    fs::path mount;
    const char* limit;
    const char* usage;
    const char* reclaimable;  ///< key in memory.stat: file pages that the kernel drops before it refuses memory
};

/// What the group `path` and its parents leave.
std::size_t left_by_group(const Controller& controller, fs::path path) {
    std::size_t left = UNBOUNDED;
    for (;; path = path.parent_path()) {
        const fs::path folder = controller.mount / path;
        if (const auto limit = sole_number(folder / controller.limit)) {
            const std::size_t usage = sole_number(folder / controller.usage).value_or(0);
            const std::size_t droppable = value_of(folder / "memory.stat", controller.reclaimable).value_or(0);
            const std::size_t held = usage - std::min(usage, droppable);
            left = std::min(left, *limit - std::min(*limit, held));
        }
        if (path.empty()) return left;
    }
}

/// Whether the comma-separated `list` of controllers names memory.
bool names_memory(std::string_view list) {
    while (!list.empty()) {
        const std::size_t comma = std::min(list.find(','), list.size());
        if (list.substr(0, comma) == "memory") return true;
        list.remove_prefix(std::min(comma + 1, list.size()));
    }
    return false;
}

/// What the control groups of this process leave; each line of /proc/self/cgroup is "id:controllers:/path".
std::size_t left_by_groups(const fs::path& root) {
    const fs::path groups = root / "sys/fs/cgroup";
    std::size_t left = UNBOUNDED;
    std::ifstream in(root / "proc/self/cgroup");
    for (std::string line; std::getline(in, line);) {
        const std::size_t first = line.find(':');
        const std::size_t second = first == std::string::npos ? first : line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const std::string controllers = line.substr(first + 1, second - first - 1);
        const fs::path path = fs::path(line.substr(second + 1)).relative_path();
        if (controllers.empty()) {
            left = std::min(left, left_by_group({groups, "memory.max", "memory.current", "inactive_file"}, path));
        } else if (names_memory(controllers)) {
            left = std::min(left, left_by_group({groups / "memory", "memory.limit_in_bytes", "memory.usage_in_bytes",
                                                 "total_inactive_file"},
                                                path));
        }
    }
    return left;
}

}  // namespace

std::size_t available_memory(const fs::path& root) {
    const auto kibibytes = value_of(root / "proc/meminfo", "MemAvailable:");
    return std::min(kibibytes ? *kibibytes * 1024 : UNBOUNDED, left_by_groups(root));
}

std::string format_bytes(double bytes) {
    if (bytes < 1e3) return fmt::format("{:.0f} B", bytes);
    if (bytes < 1e6) return fmt::format("{:.3g} kB", bytes / 1e3);
    if (bytes < 1e9) return fmt::format("{:.3g} MB", bytes / 1e6);
    if (bytes < 1e12) return fmt::format("{:.3g} GB", bytes / 1e9);
    return fmt::format("{:.4g} TB", bytes / 1e12);
}

}  // namespace clerestory
