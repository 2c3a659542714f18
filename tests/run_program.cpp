#include "run_program.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "test_device.hpp"

namespace clerestory::test {
namespace {

namespace fs = std::filesystem;

// Where a group may write nothing is trusted: folders that tests make are as most users' are, whatever the caller's
// umask.
const mode_t before [[maybe_unused]] = umask(S_IWGRP | S_IWOTH);

/// The files a child gets for stdin, stdout and stderr, and its working folder.
class FileActions {
  public:
    FileActions(const fs::path& out, const fs::path& err, const fs::path& folder) {
        constexpr int WRITE = O_WRONLY | O_CREAT | O_TRUNC;
        constexpr mode_t OWNER_ONLY = 0600;
        check(posix_spawn_file_actions_init(&actions_), "preparing a run");
        check(posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0), "stdin");
        check(posix_spawn_file_actions_addopen(&actions_, STDOUT_FILENO, out.c_str(), WRITE, OWNER_ONLY), "stdout");
        check(posix_spawn_file_actions_addopen(&actions_, STDERR_FILENO, err.c_str(), WRITE, OWNER_ONLY), "stderr");
        if (!folder.empty()) check(posix_spawn_file_actions_addchdir_np(&actions_, folder.c_str()), "working folder");
    }
    FileActions(const FileActions&) = delete;
    FileActions& operator=(const FileActions&) = delete;
    ~FileActions() { posix_spawn_file_actions_destroy(&actions_); }

    [[nodiscard]] const posix_spawn_file_actions_t* get() const noexcept { return &actions_; }

    static void check(int error, const std::string& doing) {
        if (error != 0) throw std::runtime_error(doing + ": " + std::strerror(error));
    }

  private:
    posix_spawn_file_actions_t actions_{};
};

/// This process's variables with `changes` on top, as NAME=value.
std::vector<std::string> environment_with(const std::map<std::string, std::string>& changes) {
    std::vector<std::string> all;
    for (char** entry = environ; *entry != nullptr; ++entry) {
        const std::string text = *entry;
        if (changes.count(text.substr(0, text.find('='))) == 0) all.push_back(text);
    }
    for (const auto& [name, value] : changes) all.push_back(name + "=" + value);
    return all;
}

/// Pointers into `texts`, ended by a null pointer, as exec wants them.
std::vector<char*> pointers_to(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    for (auto& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
}

/// Waits for the end.
int exit_code_of(pid_t child, rusage& usage) {
    int status = 0;
    while (wait4(child, &status, 0, &usage) < 0) {
        if (errno != EINTR) throw std::runtime_error(std::string("waiting for the program: ") + std::strerror(errno));
    }
    constexpr int SIGNAL_BASE = 128;  // what shells add to a signal's number
    return WIFEXITED(status) ? WEXITSTATUS(status) : SIGNAL_BASE + WTERMSIG(status);
}

}  // namespace

TempFolder::TempFolder() {
    std::string name = (fs::temp_directory_path() / "clerestory_test_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error(name + ": " + std::strerror(errno));
    path_ = name;
}

TempFolder::~TempFolder() {
    std::error_code ignored;  // a destructor has nobody to tell
    fs::remove_all(path_, ignored);
}

ProgramResult run_command(std::vector<std::string> words, const ProgramSetting& setting) {
    // Files rather than pipes: a program that fills one stream while the other is read would never end.
    const TempFolder streams;
    const fs::path out = streams.path() / "out";
    const fs::path err = streams.path() / "err";
    auto variables = environment_with(setting.environment);
    const FileActions actions(out, err, setting.folder);
    pid_t child = 0;
    FileActions::check(posix_spawnp(&child, words.at(0).c_str(), actions.get(), nullptr, pointers_to(words).data(),
                                    pointers_to(variables).data()),
                       "starting " + words.at(0));
    if (setting.meanwhile) setting.meanwhile(child);
    rusage usage{};
    const int exit_code = exit_code_of(child, usage);
    return {exit_code, read_file(out), read_file(err), usage.ru_maxrss};
}

ProgramResult run_program(const std::vector<std::string>& arguments, const ProgramSetting& setting) {
    std::vector<std::string> words = {CLERESTORY_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    if (!arguments.empty() && !arguments.front().starts_with('-')) {
        const std::vector<std::string> flags = test_flags();
        words.insert(words.begin() + 2, flags.begin(), flags.end());  // after the command's name
    }
    return run_command(std::move(words), setting);
}

std::string read_file(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw std::runtime_error("cannot read " + file.string());
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::vector<std::string> names_in(const fs::path& folder) {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

}  // namespace clerestory::test
