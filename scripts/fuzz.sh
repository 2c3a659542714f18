#!/usr/bin/env bash
# Feeds damaged image files to the readers for SECONDS (30 if none are given), from the inputs of fuzz/corpus, under
# AddressSanitizer and UndefinedBehaviorSanitizer: scripts/fuzz.sh [SECONDS]. An input that breaks a promise is kept.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh
install_packages clang libclang-rt-14-dev
configure sanitize
build sanitize map_fuzz
found=build/sanitize/fuzz/found
mkdir -p "$found"
# What libFuzzer finds on its way stays out of the repository. OpenEXR may ask for the 2 GB that a nested size can claim, but
# must not touch them: the limit on resident memory is the one that counts.
export ASAN_OPTIONS=allocator_may_return_null=1 LSAN_OPTIONS=suppressions=$PWD/scripts/lsan.supp:print_suppressions=0
build/sanitize/fuzz/map_fuzz -seed=1 -max_total_time="${1:-30}" -timeout=10 -rss_limit_mb=1024 -malloc_limit_mb=2100 -max_len=4096 \
    -artifact_prefix="$found/" -print_final_stats=1 "$found" fuzz/corpus/map
