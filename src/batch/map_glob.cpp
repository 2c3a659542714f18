#include "batch/map_glob.hpp"

#include <dirent.h>
#include <fmt/format.h>
#include <glob.h>
#include <sys/stat.h>

#include <algorithm>
#include <utility>

#include "batch/batch_limits.hpp"
#include "batch/counting.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

using namespace batch_limits;

/// glob(3) calls C functions without an argument of ours.
thread_local std::size_t names_left = 0;  // NOLINT(cppcoreguidelines-avoid-non-const-global-variables)

/// The next name of a folder, none once the batch has seen too many: a few stars reach all of a disk.
dirent* next_name(void* folder) {
    if (names_left == 0) return nullptr;
    --names_left;
    return ::readdir(static_cast<DIR*>(folder));
}

/// All but next_name is glob(3)'s own.
glob_t bounded_folders() {
    glob_t folders{};
    folders.gl_opendir = [](const char* name) -> void* { return ::opendir(name); };
    folders.gl_readdir = next_name;
    folders.gl_closedir = [](void* folder) { ::closedir(static_cast<DIR*>(folder)); };
    folders.gl_stat = ::stat;
    folders.gl_lstat = ::lstat;
    return folders;
}

void check_pattern(const std::string& pattern) {
    const auto refuse = [](std::size_t count, const char* what, std::size_t most) {
        throw UsageError(fmt::format("the pattern {}; {} are the most", fmt::format(fmt::runtime(what), count), most));
    };
    if (pattern.size() > LONGEST_NAME) refuse(pattern.size(), "has {} bytes with its folder", LONGEST_NAME);
    const auto count_of = [&](char c) {
        return static_cast<std::size_t>(std::count(pattern.begin(), pattern.end(), c));
    };
    if (count_of('/') > MOST_FOLDERS) refuse(count_of('/'), "goes through {} folders", MOST_FOLDERS);
    if (count_of('{') > MOST_BRACES) refuse(count_of('{'), "opens {} braces", MOST_BRACES);
    const std::size_t alternatives = alternatives_of(pattern);
    if (alternatives > MOST_ALTERNATIVES) refuse(alternatives, "stands for {} names by its braces", MOST_ALTERNATIVES);
}

}  // namespace

std::size_t alternatives_of(const std::string& pattern) {
    struct Group {
        std::size_t before;      ///< what stands before the group counts
        std::size_t closed = 0;  ///< alternatives of it that have ended
        std::size_t open = 1;    ///< those of the one that is read
    };
    std::vector<Group> groups = {{1}};
    const auto end_group = [&] {
        const Group inner = groups.back();
        groups.pop_back();
        groups.back().open = saturated_product(inner.before, saturated_sum(inner.closed, inner.open));
    };
    for (std::size_t i = 0; i < pattern.size(); ++i) {
        const char c = pattern[i];
        if (c == '\\') ++i;  // the next character stands for itself
        if (c == '{') groups.push_back({groups.back().open});
        if (c == '}' && groups.size() > 1) end_group();
        if (c == ',' && groups.size() > 1) {
            Group& group = groups.back();
            group.closed = saturated_sum(group.closed, std::exchange(group.open, 1));
        }
    }
    while (groups.size() > 1) end_group();
    return groups.back().open;
}

const std::vector<std::string>& MapGlob::files(const std::string& pattern) {
    const auto [known, fresh] = found_.try_emplace(pattern);
    if (!fresh) return known->second;
    check_pattern(pattern);
    alternatives_ += alternatives_of(pattern);
    if (alternatives_ > MOST_PICTURES) {
        throw UsageError(fmt::format("the patterns up to this one stand for {} names; {} are the most of one batch",
                                     alternatives_, MOST_PICTURES));
    }
    glob_t found = bounded_folders();
    names_left = MOST_NAMES_SEEN - names_seen_;
    if (::glob(pattern.c_str(), GLOB_BRACE | GLOB_ALTDIRFUNC, nullptr, &found) == 0) {
        known->second.assign(found.gl_pathv, found.gl_pathv + found.gl_pathc);
    }
    ::globfree(&found);
    names_seen_ = MOST_NAMES_SEEN - names_left;
    if (names_left == 0) {
        throw UsageError(fmt::format("the pattern goes through more than {} names of files; write more of the path",
                                     MOST_NAMES_SEEN));
    }
    std::sort(known->second.begin(), known->second.end());
    return known->second;
}

}  // namespace clerestory
