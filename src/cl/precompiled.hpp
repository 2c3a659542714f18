#pragma once

#include <CL/opencl.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cl/program_cache.hpp"

namespace clerestory {

/// The binary of a program whose kernels were compiled when this copy of the tool was built (cmake/precompile.cmake);
/// nothing where there is none for this device and driver. `key` is the program cache's.
std::optional<std::vector<unsigned char>> precompiled_program(const std::string& key);

/// Takes programs while they are used and, at its own end, writes them to a folder with every kernel that has run by
/// then, compiled for the group sizes that it ran with. What fails is left out: it is compiled where it is needed.
class Precompilation {
  public:
    explicit Precompilation(std::filesystem::path folder) : folder_(std::move(folder)) {}
    Precompilation(const Precompilation&) = delete;
    Precompilation& operator=(const Precompilation&) = delete;
    ~Precompilation();

    void add(std::string key, cl::Program program) { programs_.emplace_back(std::move(key), std::move(program)); }
    /// What is no program and known already: what the device answered.
    void add(const std::string& key, const std::vector<unsigned char>& bytes) const {
        ProgramCache(folder_, {}, Readers::everyone).store(key, bytes);
    }

  private:
    std::filesystem::path folder_;
    std::vector<std::pair<std::string, cl::Program>> programs_;
};

}  // namespace clerestory
