#!/usr/bin/env bash
# Feeds damaged inputs to what meets files and words from outside, for SECONDS in all (30 if none are given), from the inputs of
# fuzz/corpus, under AddressSanitizer and UndefinedBehaviorSanitizer: scripts/fuzz.sh [SECONDS]. Two thirds of the time go to image
# files. An input that breaks a promise is kept.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh
install_packages clang libclang-rt-dev
configure sanitize
build sanitize map_fuzz job_file_fuzz report_fuzz command_line_fuzz
# What libFuzzer finds on its way stays out of the repository. OpenEXR may ask for the 2 GB that a nested size can claim, but
# must not touch them: the limit on resident memory is the one that counts.
export ASAN_OPTIONS=allocator_may_return_null=1 LSAN_OPTIONS=suppressions=$PWD/scripts/lsan.supp:print_suppressions=0

# fuzz NAME SECONDS [LIBFUZZER OPTIONS]: an input may take 10 s at most, and the memory that the options say.
fuzz() {
    local name=$1 seconds=$2
    shift 2
    local found=$builds/sanitize/fuzz/found/$name
    mkdir -p "$found"
    echo "$name, $seconds s:"
    "$builds/sanitize/fuzz/${name}_fuzz" -seed=1 -max_total_time="$seconds" -timeout=10 -rss_limit_mb=1024 -max_len=4096 \
        -artifact_prefix="$found/" -print_final_stats=1 "$@" "$found" "fuzz/corpus/$name" 2>"$found.log" ||
        { cat "$found.log" >&2; exit 1; }
    grep -E "number_of_executed_units|slowest_unit_time|peak_rss" "$found.log"
}

seconds=${1:-30}
fuzz map $((seconds - 3 * (seconds / 9))) -malloc_limit_mb=2100
# Long enough for what is too much of anything.
fuzz job_file $((seconds / 9)) -max_len=65536 -dict=fuzz/job_file.dict
fuzz report $((seconds / 9)) -max_len=65536 -dict=fuzz/report.dict
fuzz command_line $((seconds / 9))
