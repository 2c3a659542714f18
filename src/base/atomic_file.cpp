#include "base/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <random>
#include <string>
#include <system_error>
#include <utility>

#include "base/descriptor.hpp"
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
constexpr std::string_view TEMPORARY_MARK = ".part";

/// A name that no other process, on this machine or another that shares the folder, is likely to hold.
fs::path temporary_name(const fs::path& target) {
    std::random_device device;
    return target.parent_path() / fmt::format("{}{:08x}{:08x}{}{}", TEMPORARY_LEAD, device(), device(), TEMPORARY_MARK,
                                              target.extension().string());
}

}  // namespace

AtomicFile::AtomicFile(fs::path target) : target_(std::move(target)) {
    std::error_code error;
    const fs::file_status status = fs::status(target_, error);
    if (fs::is_directory(status)) throw failure(target_, "write", EISDIR);
    if (target_.filename().empty()) throw failure(target_, "write", EISDIR);
    if (fs::exists(status) && !fs::is_regular_file(status)) {
        in_place_ = true;
        temporary_ = target_;
        return;
    }
    // Through a symbolic link the file it points to is replaced, not the link.
    if (fs::is_symlink(fs::symlink_status(target_, error))) {
        const fs::path resolved = fs::weakly_canonical(target_, error);
        if (!error) target_ = resolved;
    }
    make_folders(target_.parent_path());
    while (!create_temporary()) continue;
}

/// False where another name must be tried.
bool AtomicFile::create_temporary() {
    temporary_ = temporary_name(target_);
    Descriptor file(::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (file.get() < 0) {
        if (errno == EEXIST) return false;
        const int code = errno;
        temporary_.clear();
        clean_up();
        throw failure(target_, "create", code);
    }
    // Between its creation and its lock the file looks abandoned: somebody may hold it for removal, or have removed it.
    struct stat status {};
    const bool taken = ::flock(file.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (taken || (::fstat(file.get(), &status) == 0 && status.st_nlink == 0)) return false;
    lock_ = file.release();
    return true;
}

void AtomicFile::unlock() noexcept {
    if (lock_ >= 0) ::close(std::exchange(lock_, -1));
}

AtomicFile::~AtomicFile() {
    if (!committed_) clean_up();
    unlock();
}

void AtomicFile::make_folders(const fs::path& folder) {
    std::vector<fs::path> missing;
    std::error_code error;
    for (fs::path at = folder; !at.empty() && !fs::exists(at, error); at = at.parent_path()) {
        if (!at.filename().empty() && at.filename() != ".") missing.push_back(at);
        if (at == at.parent_path()) break;
    }
    std::reverse(missing.begin(), missing.end());
    for (const fs::path& at : missing) {
        if (fs::create_directory(at, error)) made_folders_.push_back(at);
        if (error) {
            const int code = error.value();
            clean_up();
            throw failure(target_, "make the folder", code);
        }
    }
}

void AtomicFile::clean_up() noexcept {
    std::error_code ignored;
    if (!in_place_ && !temporary_.empty()) fs::remove(temporary_, ignored);
    // Deepest first; a folder that somebody else has used meanwhile is not empty and stays.
    std::for_each(made_folders_.rbegin(), made_folders_.rend(),
                  [&](const fs::path& folder) { fs::remove(folder, ignored); });
    made_folders_.clear();
}

void AtomicFile::commit() {
    if (committed_) return;
    std::error_code error;
    if (!in_place_) {
        // A power cut must not leave neither the old file nor the new one.
        if (fs::exists(target_, error)) sync_file(lock_, target_);
        fs::rename(temporary_, target_, error);
        if (error) throw failure(target_, "rename into place", error.value());
        remember_unsynced(target_, made_folders_);
    }
    committed_ = true;
}

std::size_t remove_abandoned(const fs::path& folder) noexcept {
    std::size_t removed = 0;
    try {
        std::error_code error;
        for (const auto& entry : fs::directory_iterator(folder.empty() ? fs::path(".") : folder, error)) {
            const std::string name = entry.path().filename().string();
            if (!name.starts_with(TEMPORARY_LEAD) || name.find(TEMPORARY_MARK) == std::string::npos) continue;
            const Descriptor file(::open(entry.path().c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW));
            if (file.get() < 0 || ::flock(file.get(), LOCK_EX | LOCK_NB) != 0) continue;
            std::error_code gone;
            removed += fs::remove(entry.path(), gone) ? 1 : 0;
        }
    } catch (const std::exception&) {
        // A folder that cannot be tidied is no reason not to work.
    }
    return removed;
}

void write_bytes(const fs::path& target, std::span<const char> bytes) {
    AtomicFile file(target);
    Descriptor out(::open(file.temporary().c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC));
    if (out.get() < 0) throw failure(target, "open", errno);
    while (!bytes.empty()) {
        const ssize_t written = ::write(out.get(), bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) throw failure(target, "write", errno);
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    if (out.close() != 0) throw failure(target, "write", errno);
    file.commit();
}

void write_text(const fs::path& target, std::string_view text) { write_bytes(target, {text.data(), text.size()}); }

}  // namespace clerestory
