#include "base/atomic_file.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <system_error>
#include <utility>

#include "base/durable.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// One line for a failed system call, with advice for the causes that people meet.
OutputError failure(const fs::path& target, const char* doing, int code) {
    const char* advice = "check the path";
    if (code == ENOSPC || code == EDQUOT) advice = "free some space or write elsewhere";
    if (code == EACCES || code == EPERM || code == EROFS) advice = "choose a folder you may write to";
    if (code == ENOTDIR) advice = "a part of the path is a file, not a folder";
    return OutputError(
        fmt::format("{}: could not {}: {}; {}", target.string(), doing, std::generic_category().message(code), advice));
}

constexpr std::string_view TEMPORARY_LEAD = ".clerestory-";
constexpr std::string_view TEMPORARY_END = ".part";
constexpr std::size_t TEMPORARY_DIGITS = 16;
constexpr mode_t MODE_BITS = S_IRWXU | S_IRWXG | S_IRWXO;

/// A name that no other process, on this machine or another that shares the folder, is likely to hold.
std::string temporary_name() {
    std::random_device device;
    return fmt::format("{}{:08x}{:08x}{}", TEMPORARY_LEAD, device(), device(), TEMPORARY_END);
}

bool is_temporary_name(std::string_view name) {
    if (name.size() != TEMPORARY_LEAD.size() + TEMPORARY_DIGITS + TEMPORARY_END.size()) return false;
    const auto digits = name.substr(TEMPORARY_LEAD.size(), TEMPORARY_DIGITS);
    return name.starts_with(TEMPORARY_LEAD) && name.ends_with(TEMPORARY_END) &&
           digits.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

std::optional<mode_t> umask_of_results;

/// While it lives, what is made has the permissions of results. The umask is the whole process's: what another thread
/// makes in this moment has them too, in a folder that is private.
class AsResult {
  public:
    AsResult() : lock_(mutex()) {
        if (umask_of_results) before_ = ::umask(*umask_of_results);
    }
    AsResult(const AsResult&) = delete;
    AsResult& operator=(const AsResult&) = delete;
    ~AsResult() {
        if (umask_of_results) ::umask(before_);
    }

  private:
    static std::mutex& mutex() {
        static std::mutex only;
        return only;
    }
    std::lock_guard<std::mutex> lock_;
    mode_t before_ = 0;
};

template <class Make>
auto as_result(Make make) {
    const AsResult now;
    return make();
}

/// Gives a new file the access list of an old one. False where that cannot be.
bool copy_access_list(int folder, const std::string& name, int file) {
    constexpr const char* LIST = "system.posix_acl_access";
    constexpr std::size_t MOST_BYTES = 65536;  // of any attribute
    std::vector<char> list(MOST_BYTES);
    const Descriptor old(::openat(folder, name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    const ssize_t size = old.get() < 0 ? -1 : ::fgetxattr(old.get(), LIST, list.data(), list.size());
    if (size > 0) return ::fsetxattr(file, LIST, list.data(), static_cast<std::size_t>(size), 0) == 0;
    ::fremovexattr(file, LIST);  // the folder may have given it one
    return true;
}

/// Gives a new file what an old one lets whom do; less where it cannot have its group.
void copy_permissions(const TargetPath& old, int file) {
    mode_t mode = old.there->st_mode & MODE_BITS;
    struct stat state {};
    const bool same_group = ::fstat(file, &state) == 0 && state.st_gid == old.there->st_gid;
    const bool has_group = same_group || ::fchown(file, static_cast<uid_t>(-1), old.there->st_gid) == 0;
    const bool has_list = copy_access_list(old.folder.get(), old.name, file);
    if (!has_group || !has_list)
        mode =
            (mode & mode_t{S_IRWXU | S_IRWXO}) | ((mode & mode_t{S_IRWXO}) << 3);  // the group gets what all others do
    ::fchmod(file, mode);
}

}  // namespace

void keep_all_but_results_private() { umask_of_results = ::umask(S_IRWXG | S_IRWXO); }

AtomicFile::AtomicFile(fs::path target, Readers readers) : asked_(std::move(target)), readers_(readers) {
    try {
        find_target();
        if (target_.in_place) {
            open_in_place();
        } else {
            while (!create_temporary()) continue;
        }
    } catch (const Error&) {
        clean_up();
        throw;
    }
}

void AtomicFile::find_target() {
    if (asked_.filename().empty()) throw failure(asked_, "write", EISDIR);
    try {
        target_ = follow_target(asked_, [this](int folder, const std::string& name, const fs::path& made) {
            make_folder(folder, name, made);
        });
    } catch (const std::system_error& error) {
        throw failure(asked_, "write", error.code().value());
    }
}

/// At its end where it is a file that somebody has open: a shell's >> means that.
void AtomicFile::open_in_place() {
    file_ =
        Descriptor(::openat(target_.folder.get(), target_.name.c_str(), O_WRONLY | O_APPEND | O_NOCTTY | O_CLOEXEC));
    if (file_.get() < 0) throw failure(asked_, "open", errno);
}

/// False where another name must be tried.
bool AtomicFile::create_temporary() {
    constexpr mode_t ALL_READ_AND_WRITE = 0666;
    constexpr mode_t ALL_READ = 0644;
    constexpr mode_t OWNER_ALONE = 0600;
    const bool is_result = readers_ == Readers::umask && !target_.there;
    const std::string name = temporary_name();
    const auto create = [&] {
        return Descriptor(::openat(target_.folder.get(), name.c_str(),
                                   O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC,
                                   is_result ? ALL_READ_AND_WRITE : OWNER_ALONE));
    };
    Descriptor file = is_result ? as_result(create) : create();
    if (file.get() < 0) {
        if (errno == EEXIST) return false;
        throw failure(asked_, "create", errno);
    }
    // Between its creation and its lock the file looks abandoned: somebody may hold it for removal, or have removed it.
    struct stat status {};
    const bool taken = ::flock(file.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (taken || (::fstat(file.get(), &status) == 0 && status.st_nlink == 0)) return false;
    if (readers_ == Readers::everyone) ::fchmod(file.get(), ALL_READ);
    if (readers_ == Readers::umask && target_.there) copy_permissions(target_, file.get());
    file_ = std::move(file);
    temporary_ = name;
    return true;
}

AtomicFile::~AtomicFile() {
    if (!committed_) clean_up();
}

void AtomicFile::make_folder(int folder, const std::string& name, const fs::path& made) {
    constexpr mode_t ALL = 0777;
    constexpr mode_t ALL_ENTER = 0755;
    const bool is_result = readers_ == Readers::umask;
    const auto make = [&] { return ::mkdirat(folder, name.c_str(), is_result ? ALL : S_IRWXU); };
    const int failed = is_result ? as_result(make) : make();
    if (failed != 0 && errno == EEXIST) return;
    if (failed != 0) throw failure(asked_, "make the folder", errno);
    if (readers_ == Readers::everyone) ::fchmodat(folder, name.c_str(), ALL_ENTER, 0);
    made_folders_.push_back(made);
}

void AtomicFile::clean_up() noexcept {
    std::error_code ignored;
    if (!temporary_.empty()) ::unlinkat(target_.folder.get(), temporary_.c_str(), 0);
    // Deepest first; a folder that somebody else has used meanwhile is not empty and stays.
    std::for_each(made_folders_.rbegin(), made_folders_.rend(),
                  [&](const fs::path& folder) { fs::remove(folder, ignored); });
    made_folders_.clear();
}

void AtomicFile::write(std::span<const char> bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(file_.get(), bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) throw failure(asked_, "write", errno);
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
}

void AtomicFile::commit() {
    if (committed_) return;
    if (!target_.in_place) {
        const int folder = target_.folder.get();
        // A network disk may be full, and say so only when a file is closed; this one stays open for its lock.
        if (Descriptor(::dup(file_.get())).close() != 0) throw failure(asked_, "write", errno);
        // A power cut must not leave neither the old file nor the new one.
        if (target_.there) sync_file(file_.get(), target_.path);
        if (::renameat(folder, temporary_.c_str(), folder, target_.name.c_str()) != 0) {
            throw failure(asked_, "rename into place", errno);
        }
        remember_unsynced(target_.path, made_folders_);
    }
    committed_ = true;
    if (file_.close() != 0 && target_.in_place) throw failure(asked_, "write", errno);
}

std::size_t remove_abandoned(const fs::path& folder) noexcept {
    std::size_t removed = 0;
    const std::unique_ptr<DIR, int (*)(DIR*)> opened(::opendir(folder.empty() ? "." : folder.c_str()), ::closedir);
    if (!opened) return 0;
    while (const dirent* entry = ::readdir(opened.get())) {
        if (!is_temporary_name(entry->d_name)) continue;
        const int in = ::dirfd(opened.get());
        constexpr int FLAGS = O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
        Descriptor file(::openat(in, entry->d_name, O_RDWR | FLAGS));  // locks of network disks need it
        if (file.get() < 0) file = Descriptor(::openat(in, entry->d_name, O_RDONLY | FLAGS));
        struct stat state {};
        if (file.get() < 0 || ::fstat(file.get(), &state) != 0) continue;
        if (!S_ISREG(state.st_mode) || state.st_uid != geteuid()) continue;
        if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) continue;
        removed += ::unlinkat(in, entry->d_name, 0) == 0 ? 1 : 0;
    }
    return removed;
}

void write_bytes(const fs::path& target, std::span<const char> bytes, Readers readers) {
    AtomicFile file(target, readers);
    file.write(bytes);
    file.commit();
}

void write_text(const fs::path& target, std::string_view text, Readers readers) {
    write_bytes(target, {text.data(), text.size()}, readers);
}

}  // namespace clerestory
