#include "base/output_check.hpp"

#include <fmt/format.h>
#include <sys/stat.h>

#include <map>
#include <system_error>

#include "error.hpp"

namespace clerestory {
namespace fs = std::filesystem;

std::optional<FileIdentity> folder_identity(const fs::path& folder) {
    std::error_code error;
    const fs::path real = fs::weakly_canonical(fs::absolute(folder.empty() ? "." : folder, error), error);
    if (error) return std::nullopt;
    for (fs::path existing = real;; existing = existing.parent_path()) {
        struct stat status {};
        if (::stat(existing.c_str(), &status) == 0) {
            return FileIdentity{status.st_dev, status.st_ino, real.lexically_relative(existing).string()};
        }
        if (existing == existing.parent_path()) return std::nullopt;
    }
}

std::optional<FileIdentity> file_identity(const fs::path& path) {
    if (path.empty()) return std::nullopt;
    struct stat status {};
    if (::stat(path.c_str(), &status) == 0) {
        if (!S_ISREG(status.st_mode)) return std::nullopt;
        return FileIdentity{status.st_dev, status.st_ino, {}};
    }
    auto identity = folder_identity(path.parent_path());  // a link to nothing would itself be replaced
    if (identity) identity->name = (fs::path(identity->name) / path.filename()).string();
    return identity;
}

void check_outputs(std::span<const fs::path> inputs, std::span<const fs::path> outputs) {
    const auto is_file = [](const fs::path& path) { return !path.empty() && path != "-"; };
    std::map<FileIdentity, fs::path> read;
    for (const fs::path& input : inputs) {
        if (!is_file(input)) continue;
        if (const auto identity = file_identity(input)) read.try_emplace(*identity, input);
    }
    std::map<FileIdentity, fs::path> written;
    for (const fs::path& output : outputs) {
        if (!is_file(output)) continue;
        const auto identity = file_identity(output);
        if (!identity) continue;
        if (const auto input = read.find(*identity); input != read.end()) {
            throw UsageError(fmt::format("{} would replace {}, which is read; give the output another name",
                                         output.string(), input->second.string()));
        }
        const auto [other, fresh] = written.try_emplace(*identity, output);
        if (fresh) continue;
        const std::string also =
            other->second == output ? std::string() : fmt::format(", which is {} too", other->second.string());
        throw UsageError(
            fmt::format("two results would be written to {}{}; give each another name", output.string(), also));
    }
}

}  // namespace clerestory
