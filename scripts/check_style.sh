#!/usr/bin/env bash
# clang-format and clang-tidy over the whole tree; no warning of the compiler.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh
install_packages clang-format clang-tidy
git ls-files '*.cpp' '*.hpp' '*.h' | xargs clang-format --dry-run -Werror
configure release -DCLERESTORY_TESTS=ON -DCLERESTORY_BENCH=ON
build release clerestory_core # generated sources must stand before they are read
git ls-files 'src/*.cpp' | xargs -P "$(nproc)" -n 4 clang-tidy --quiet -p build/release
