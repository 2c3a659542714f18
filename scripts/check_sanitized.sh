#!/usr/bin/env bash
# The tests of the host code with AddressSanitizer and UndefinedBehaviorSanitizer.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh
install_packages clang libclang-rt-dev
configure sanitize
build sanitize clerestory_tests
# PoCL and LLVM keep memory until the process ends: leaks are looked for in our own code by the suppressions.
export ASAN_OPTIONS=detect_leaks=1:protect_shadow_gap=0:strict_string_checks=1
export LSAN_OPTIONS=suppressions=$PWD/scripts/lsan.supp:print_suppressions=0
export UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1
"$builds/sanitize/tests/clerestory_tests" --gtest_brief=1 --gtest_filter="${CLERESTORY_SANITIZED_TESTS:-*Image*:*Exr*:Durable*:Png*:Atomic*:Trust*:TextEscape*:Comparison*:Program*:Cl*:Fresnel*:Plot*}"
