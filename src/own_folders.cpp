#include "own_folders.hpp"

#include <dlfcn.h>

#include <system_error>

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// The folder of the file that holds this code: the shared library, or the program itself.
fs::path library_folder() {
    static const char here = 0;
    Dl_info info{};
    if (dladdr(&here, &info) == 0 || info.dli_fname == nullptr) return {};
    std::error_code error;
    return fs::canonical(info.dli_fname, error).parent_path();
}

fs::path program_folder() {
    std::error_code error;
    return fs::read_symlink("/proc/self/exe", error).parent_path();
}

}  // namespace

std::vector<fs::path> own_folders(std::string_view what) {
    const bool is_data = what == "data";
    std::vector<fs::path> folders;
    const auto add = [&](const fs::path& home, const char* installed) {
        if (home.empty()) return;
        folders.push_back((home / installed).lexically_normal());
        folders.push_back(is_data ? home / "data" : home);
    };
    add(program_folder(), is_data ? CLERESTORY_DATA_FROM_BIN : CLERESTORY_MODULES_FROM_BIN);
    add(library_folder(), is_data ? CLERESTORY_DATA_FROM_LIB : CLERESTORY_MODULES_FROM_LIB);
    return folders;
}

}  // namespace clerestory
