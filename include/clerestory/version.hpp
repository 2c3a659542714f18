#pragma once

#include "clerestory/export.hpp"

namespace clerestory {

/// What was built, from what, by what.
struct BuildInfo {
    const char* version;
    const char* commit;    ///< of the source tree, "-dirty" where it had changes; "unknown" without its history
    const char* compiler;  ///< name, version, kind of build
};

CLERESTORY_API const BuildInfo& build_info() noexcept;

}  // namespace clerestory
