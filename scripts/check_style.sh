#!/usr/bin/env bash
# clang-format and clang-tidy over the whole tree; no warning of the compiler.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh
install_packages clang clang-format clang-tidy
git ls-files '*.cpp' '*.hpp' '*.h' | xargs clang-format --dry-run -Werror
# clang-tidy reads no header that g++ has compiled: a configuration of its own.
configure tidy
cmake --build "$builds/tidy" --target kernel_sources.cpp page_texts.cpp source_digest.cpp clerestory_commit -- --quiet
sed -n 's/^ *"file": "\(.*\)",\?$/\1/p' "$builds/tidy/compile_commands.json" | xargs -d "\n" -P "$(nproc)" -n 1 clang-tidy --quiet -p "$builds/tidy"
