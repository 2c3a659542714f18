#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>

/// A part of the module that holds OpenImageIO, which is content with what it gets: it gives black, grey or stale
/// texels for what a file does not hold, and takes memory for whatever a header claims. So a file goes through the
/// library that defines its format first, which is asked to stop at whatever it notices; its texels are thrown away.
namespace clerestory::file_check {

/// What is wrong with a file.
class Damage : public std::runtime_error {
  public:
    explicit Damage(const std::string& how) : std::runtime_error(how) {}
};

/// A file of a kind that is not read; its words go on after the file's name.
class Refusal : public std::runtime_error {
  public:
    explicit Refusal(const std::string& why) : std::runtime_error(why) {}
};

class FileCheck {
  public:
    FileCheck() = default;
    FileCheck(const FileCheck&) = delete;
    FileCheck& operator=(const FileCheck&) = delete;
    virtual ~FileCheck() = default;

    /// Turns to the page that will be read, from 0 as OpenImageIO counts them, and holds what it claims against the
    /// file's length. Throws Damage or Refusal.
    virtual void check_page(int /*page*/) {}

    /// Decodes every texel and keeps none. Throws Damage.
    virtual void check_texels() = 0;
};

/// Each opens a file, and holds what its header claims against its length. Throws Damage or Refusal.
std::unique_ptr<FileCheck> check_tiff(const char* file);
std::unique_ptr<FileCheck> check_png(const char* file);
std::unique_ptr<FileCheck> check_jpeg(const char* file);

struct CloseFile {
    void operator()(std::FILE* file) const noexcept { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

/// Opens a file to be read, and tells its length. Throws Refusal.
File open_file(const char* file, std::uint64_t& length);

/// Throws Damage where `length` bytes cannot hold so many decoded ones, of which a byte gives `most` at best.
void check_claim(std::uint64_t width, std::uint64_t height, double decoded, double most, std::uint64_t length);

}  // namespace clerestory::file_check
