#include "bundled.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <system_error>

#include "base/install_paths.hpp"
#include "error.hpp"

namespace clerestory {
namespace {

namespace fs = std::filesystem;

}  // namespace

fs::path bundled_map(std::string_view name) {
    for (const auto& [folder, program] : install_paths("data")) {
        fs::path file = folder / fmt::format("{}.exr", name);
        std::error_code error;
        if (fs::is_regular_file(file, error)) return file;
    }
    const std::vector<std::string> known = bundled_map_names();
    throw InputError(fmt::format("{}: no map of that name comes with the program; {}", name,
                                 known.empty() ? "its data folder is missing, so name a file or install it again"
                                               : fmt::format("it has {}", fmt::join(known, ", "))));
}

std::vector<std::string> bundled_map_names() {
    std::vector<std::string> names;
    for (const auto& [folder, program] : install_paths("data")) {
        std::error_code error;
        for (const auto& entry : fs::directory_iterator(folder, error)) {
            if (entry.path().extension() == ".exr") names.push_back(entry.path().stem().string());
        }
    }
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    return names;
}

}  // namespace clerestory
