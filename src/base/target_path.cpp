#include "base/target_path.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <climits>
#include <deque>
#include <system_error>
#include <utility>

#include "error.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

constexpr int MOST_LINKS = 40;  // as the kernel follows

[[noreturn]] void fail(int code) { throw std::system_error(code, std::generic_category()); }

Descriptor open_folder_in(int folder, const char* name) {
    Descriptor opened(::openat(folder, name, O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (opened.get() < 0) fail(errno);
    return opened;
}

/// The state of what a name stands for, a link as itself; nothing where nothing does.
std::optional<struct stat> state_of(int folder, const char* name, int flags) {
    struct stat state {};
    if (::fstatat(folder, name, &state, flags) == 0) return state;
    if (errno != ENOENT) fail(errno);
    return std::nullopt;
}

/// Links of /proc stand for open files, whose names may be anybody's by now.
bool is_proc(int folder) {
    struct statfs state {};
    return ::fstatfs(folder, &state) == 0 && state.f_type == PROC_SUPER_MAGIC;
}

bool is_mine_or_roots(const struct stat& state) { return state.st_uid == geteuid() || state.st_uid == 0; }

/// Whether somebody may have put it where everybody can, for others to stumble over.
bool may_be_planted(int folder, const struct stat& state) {
    struct stat holds {};
    if (::fstat(folder, &holds) != 0) fail(errno);
    const bool anybody_may_add = (holds.st_mode & S_ISVTX) != 0 && (holds.st_mode & (S_IWGRP | S_IWOTH)) != 0;
    return anybody_may_add && !is_mine_or_roots(state) && state.st_uid != holds.st_uid;
}

/// Walks a path name by name, each from the folder that the one before has led to.
class Walk {
  public:
    Walk(const fs::path& path, const MakeFolder& make_folder) : target_(path), make_folder_(make_folder) {
        begin(path);
    }

    TargetPath to_its_end() {
        while (!names_.empty()) {
            const std::string name = std::move(names_.front());
            names_.pop_front();
            if (name.empty() || name == ".") continue;
            if (name == "..") {
                enter(name);
            } else if (step(name)) {
                return std::move(found_);
            }
        }
        fail(EISDIR);
    }

  private:
    /// Puts a path's names before those that are left to walk.
    void begin(const fs::path& path) {
        if (path.is_absolute()) {
            found_.folder = open_folder_in(AT_FDCWD, "/");
            found_.path = "/";
        } else if (found_.folder.get() < 0) {
            found_.folder = open_folder_in(AT_FDCWD, ".");
        }
        std::deque<std::string> names;
        for (const fs::path& part : path.relative_path()) names.push_back(part.string());
        names_.insert(names_.begin(), names.begin(), names.end());
    }

    /// True at the end of the walk.
    bool step(const std::string& name) {
        const int folder = found_.folder.get();
        const auto state = state_of(folder, name.c_str(), AT_SYMLINK_NOFOLLOW);
        const bool last = names_.empty();
        if (state && S_ISLNK(state->st_mode) && !(last && is_proc(folder))) {
            follow(name, *state, last);
            return false;
        }
        if (last) {
            arrive(name);
            return true;
        }
        if (!state) make_folder_(folder, name, found_.path / name);
        enter(name);
        return false;
    }

    void enter(const std::string& name) {
        found_.folder = open_folder_in(found_.folder.get(), name.c_str());
        found_.path /= name;
    }

    void follow(const std::string& name, const struct stat& link, bool last) {
        if (last ? !is_mine_or_roots(link) : may_be_planted(found_.folder.get(), link)) refuse(name, link, "a link");
        if (++links_ > MOST_LINKS) fail(ELOOP);
        std::array<char, PATH_MAX> to{};
        const ssize_t length = ::readlinkat(found_.folder.get(), name.c_str(), to.data(), to.size());
        if (length < 0) fail(errno);
        begin(std::string(to.data(), static_cast<std::size_t>(length)));
    }

    void arrive(const std::string& name) {
        const int folder = found_.folder.get();
        found_.name = name;
        found_.path /= name;
        found_.there = state_of(folder, name.c_str(), 0);
        if (!found_.there) return;
        if (S_ISDIR(found_.there->st_mode)) fail(EISDIR);
        found_.in_place = !S_ISREG(found_.there->st_mode) || is_proc(folder);
        if (found_.in_place && may_be_planted(folder, *found_.there)) refuse(name, *found_.there, "a pipe or device");
    }

    [[noreturn]] void refuse(const std::string& name, const struct stat& state, const char* what) const {
        throw OutputError(fmt::format("{}: {} is {} of user {}, who could lead the result anywhere; write elsewhere",
                                      target_.string(), (found_.path / name).string(), what, state.st_uid));
    }

    fs::path target_;
    const MakeFolder& make_folder_;
    TargetPath found_;
    std::deque<std::string> names_;
    int links_ = 0;
};

}  // namespace

TargetPath follow_target(const fs::path& path, const MakeFolder& make_folder) {
    return Walk(path, make_folder).to_its_end();
}

}  // namespace clerestory
