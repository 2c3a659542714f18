#include "cl/precompiled.hpp"

#include <exception>

#include "base/install_paths.hpp"
#include "base/trust.hpp"

namespace clerestory {

std::optional<std::vector<unsigned char>> precompiled_program(const std::string& key) {
    for (const auto& [folder, program] : install_paths("modules")) {
        const ProgramCache programs(folder / "programs", Trust::beside(program));
        if (auto binary = programs.load(key)) return binary;
    }
    return std::nullopt;
}

Precompilation::~Precompilation() {
    const ProgramCache programs(folder_, {}, Readers::everyone);
    for (const auto& [key, program] : programs_) {
        try {
            const auto binaries = program.getInfo<CL_PROGRAM_BINARIES>();
            if (binaries.size() == 1) programs.store(key, binaries.front());
        } catch (const std::exception&) {
            continue;
        }
    }
}

}  // namespace clerestory
