#pragma once

#include <filesystem>
#include <string>

namespace clerestory::commands {

/// Where built programs are kept.
struct Caches {
    std::filesystem::path programs;  ///< CLERESTORY_CACHE_DIR, else the user's own cache folder
    std::string trouble;             ///< why caches lie elsewhere, for a warning; empty: they don't
};

/// Sees to it, once, that programs can be kept where nobody else can put any: built programs and PoCL's kernels are
/// code. Each goes to the folder that the user names, else to the user's cache folder; where that cannot be written, or
/// others could write to it, to a private one within (if it is sticky, as shared folders are) or in a temporary
/// directory. PoCL is told by POCL_CACHE_DIR: without a place it has no device, and without HOME it would take one in
/// /tmp, whosever it is. Before the first call of OpenCL.
const Caches& prepare_caches();

/// The folder that a variable names; one that depends on the current folder is none, because programs are run from it.
std::filesystem::path folder_named_by(const char* variable);

}  // namespace clerestory::commands
