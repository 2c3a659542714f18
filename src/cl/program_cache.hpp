#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/atomic_file.hpp"
#include "base/trust.hpp"

namespace clerestory {

/// Built programs in a folder, so that later runs load them in a few milliseconds instead of compiling the source.
/// A cache can only help: whatever fails in it is as if it were empty, and an entry is not used where it is damaged or
/// where others could have written it: a built program is code.
class ProgramCache {
  public:
    /// `folder` empty: a cache that keeps nothing.
    ///   trust    whose entries are used
    ///   readers  of what is stored, and of folders that are made for it
    explicit ProgramCache(std::filesystem::path folder, Trust trust = {}, Readers readers = Readers::owner)
        : folder_(std::move(folder)), trust_(std::move(trust)), readers_(readers) {}

    /// The binary that was kept for `key`: all that decides it (source, options, device, driver).
    [[nodiscard]] std::optional<std::vector<unsigned char>> load(const std::string& key) const;
    /// Keeps `binary` for `key`.
    void store(const std::string& key, const std::vector<unsigned char>& binary) const noexcept;

  private:
    [[nodiscard]] std::filesystem::path file_of(const std::string& key) const;

    std::filesystem::path folder_;
    Trust trust_;
    Readers readers_;
};

}  // namespace clerestory
