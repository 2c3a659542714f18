#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "run_program.hpp"

/// A second user, for tests of what one may do to another: as root only, who can give files away.
namespace clerestory::test {

struct OtherUser {
    static constexpr uid_t ID = 65534;  ///< "nobody" wherever it has a name

    static bool is_at_hand() { return geteuid() == 0; }

    /// Makes the other user own a file, a folder or a link.
    static void give(const std::filesystem::path& path) {
        if (lchown(path.c_str(), ID, ID) != 0) throw std::system_error(errno, std::generic_category(), path.string());
    }

    /// A command line that runs `words` as the other user.
    static std::vector<std::string> words_for(std::vector<std::string> words) {
        words.insert(words.begin(), {"setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"});
        return words;
    }
};

}  // namespace clerestory::test
