#pragma once

#include <filesystem>
#include <string>

namespace clerestory::commands {

/// Where built programs are kept.
struct Caches {
    std::filesystem::path programs;  ///< CLERESTORY_CACHE_DIR, else the user's own cache folder
    std::string trouble;             ///< why caches lie elsewhere, for a warning; empty: they don't
};

/// Sees to it, once, that programs can be kept: where the user's cache folder cannot be written, or there is none, they
/// go to a private folder under the temporary directory, and so do PoCL's (by POCL_CACHE_DIR), which without a place
/// has no device. Folders that the user names are taken as they are. Before the first call of OpenCL.
const Caches& prepare_caches();

/// The folder that a variable names; one that depends on the current folder is none, because programs are run from it.
std::filesystem::path folder_named_by(const char* variable);

}  // namespace clerestory::commands
