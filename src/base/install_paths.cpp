#include "base/install_paths.hpp"

#include <dlfcn.h>
#include <link.h>
#include <sys/auxv.h>

#include <string>
#include <system_error>

namespace clerestory {
namespace {

namespace fs = std::filesystem;

/// The shared library that holds this code; none where it is part of the program itself, whose name here
/// is only what its caller calls it: a bare word that leads to whatever the current folder holds.
fs::path library_file() {
    static const char here = 0;
    Dl_info info{};
    void* entry = nullptr;
    if (dladdr1(&here, &info, &entry, RTLD_DL_LINKMAP) == 0 || entry == nullptr) return {};
    const fs::path file = static_cast<const link_map*>(entry)->l_name;  // empty for the program
    if (!file.is_absolute()) return {};
    std::error_code error;
    return fs::canonical(file, error);
}

/// The running program, as the kernel knows it: by /proc, or where that is not mounted by the path that
/// was executed, if that leads there from anywhere.
fs::path program_file() {
    std::error_code error;
    if (fs::path file = fs::read_symlink("/proc/self/exe", error); file.is_absolute()) return file;
    const auto executed = getauxval(AT_EXECFN);  // an address, which the kernel hands over as a number
    // NOLINTNEXTLINE(performance-no-int-to-ptr)
    const fs::path file = executed != 0 ? reinterpret_cast<const char*>(executed) : "";
    return file.is_absolute() ? fs::canonical(file, error) : fs::path();
}

}  // namespace

std::vector<InstallPath> install_paths(std::string_view what) {
    const bool is_data = what == "data";
    std::vector<InstallPath> paths;
    const auto add = [&](const fs::path& program, const char* installed) {
        if (program.empty()) return;
        const fs::path home = program.parent_path();
        paths.push_back({(home / installed).lexically_normal(), program});
        paths.push_back({is_data ? home / "data" : home, program});
    };
    add(program_file(), is_data ? CLERESTORY_DATA_FROM_BIN : CLERESTORY_MODULES_FROM_BIN);
    add(library_file(), is_data ? CLERESTORY_DATA_FROM_LIB : CLERESTORY_MODULES_FROM_LIB);
    return paths;
}

}  // namespace clerestory
