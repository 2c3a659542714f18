#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace clerestory {

/// Built programs in a folder, so that later runs load them in a few milliseconds instead of compiling the source.
/// A cache can only help: whatever fails in it is as if it were empty, and a damaged entry is not used.
class ProgramCache {
  public:
    /// `folder` empty: a cache that keeps nothing.
    explicit ProgramCache(std::filesystem::path folder) : folder_(std::move(folder)) {}

    /// The binary that was kept for `key`: all that decides it (source, options, device, driver).
    [[nodiscard]] std::optional<std::vector<unsigned char>> load(const std::string& key) const;
    /// Keeps `binary` for `key`.
    void store(const std::string& key, const std::vector<unsigned char>& binary) const noexcept;

  private:
    [[nodiscard]] std::filesystem::path file_of(const std::string& key) const;

    std::filesystem::path folder_;
};

}  // namespace clerestory
