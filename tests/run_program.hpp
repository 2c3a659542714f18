#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

/// What end-to-end tests share: starting the program itself, and folders that vanish with the test.
namespace clerestory::test {

/// How a run ended and what it said.
struct ProgramResult {
    int exit_code = 0;  ///< as a shell gives it: 128 + the signal's number where a signal ended the run
    std::string out;    ///< all of stdout
    std::string err;    ///< all of stderr
    long peak_kib = 0;  ///< most memory that it had at once
};

/// Where and how to run, beyond the arguments.
struct ProgramSetting {
    std::map<std::string, std::string> environment = {};  ///< variables set on top of the test's own
    std::filesystem::path folder = {};                    ///< working folder; empty: the test's own
    std::function<void(pid_t)> meanwhile = {};            ///< called with the process once it runs; it may send signals
};

/// A new empty folder, removed with all that is in it at the end of its scope.
class TempFolder {
  public:
    TempFolder();
    TempFolder(const TempFolder&) = delete;
    TempFolder& operator=(const TempFolder&) = delete;
    ~TempFolder();

    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
    /// The path of `name` in this folder, as text for an argument.
    [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

  private:
    std::filesystem::path path_;
};

/// Runs the program of this build with `arguments` and an empty stdin, and waits for its end. Throws
/// std::runtime_error where it cannot be started.
ProgramResult run_program(const std::vector<std::string>& arguments, const ProgramSetting& setting = {});

/// The same for any command line; the first word is looked for in PATH.
ProgramResult run_command(std::vector<std::string> words, const ProgramSetting& setting = {});

/// All bytes of a file. Throws std::runtime_error where it cannot be read.
std::string read_file(const std::filesystem::path& file);

/// Names of all that a folder holds, sorted; for tests that nothing half-written is left.
std::vector<std::string> names_in(const std::filesystem::path& folder);

}  // namespace clerestory::test
