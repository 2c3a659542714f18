#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace clerestory {

/// A file that appears whole or not at all: written under a temporary name beside its target, and renamed by commit().
/// Without commit() the temporary file is removed. Throws OutputError.
class AtomicFile {
  public:
    explicit AtomicFile(std::filesystem::path target);
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;
    ~AtomicFile();

    /// Where to write until commit().
    [[nodiscard]] const std::filesystem::path& temporary() const noexcept { return temporary_; }
    void commit();

  private:
    std::filesystem::path target_;
    std::filesystem::path temporary_;
    bool committed_ = false;
};

/// Writes `text` to `target`, whole or not at all; makes the folders it needs. Throws OutputError.
void write_text(const std::filesystem::path& target, std::string_view text);

}  // namespace clerestory
