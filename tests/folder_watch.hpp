#pragma once

#include <sys/inotify.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace clerestory::test {

/// Tells which files of a folder have been opened since it was made.
class FolderWatch {
  public:
    explicit FolderWatch(const std::filesystem::path& folder) : fd_(inotify_init1(IN_NONBLOCK | IN_CLOEXEC)) {
        add(folder);
        for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
            if (entry.is_directory()) add(entry.path());
        }
    }
    FolderWatch(const FolderWatch&) = delete;
    FolderWatch& operator=(const FolderWatch&) = delete;
    ~FolderWatch() { ::close(fd_); }

    /// Files alone: to look whether a folder holds something is no harm.
    [[nodiscard]] std::vector<std::string> opened() const {
        std::vector<std::string> names;
        alignas(inotify_event) std::array<char, 1 << 16> events{};
        for (ssize_t size = 0; (size = ::read(fd_, events.data(), events.size())) > 0;) {
            for (std::size_t at = 0; at < static_cast<std::size_t>(size);) {
                inotify_event event{};
                std::memcpy(&event, events.data() + at, sizeof event);
                if ((event.mask & IN_ISDIR) == 0 && event.len > 0) {
                    names.push_back(folders_.at(event.wd) / (events.data() + at + sizeof event));
                }
                at += sizeof event + event.len;
            }
        }
        return names;
    }

  private:
    void add(const std::filesystem::path& folder) {
        const int watch = inotify_add_watch(fd_, folder.c_str(), IN_OPEN);
        if (watch < 0) throw std::runtime_error("cannot watch " + folder.string());
        folders_[watch] = folder;
    }

    int fd_;
    std::map<int, std::filesystem::path> folders_;
};

}  // namespace clerestory::test
