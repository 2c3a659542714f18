#pragma once

#include <filesystem>

namespace clerestory {

/// The folder that holds the running program, through symbolic links; empty where the system does not say.
std::filesystem::path program_folder();

}  // namespace clerestory
