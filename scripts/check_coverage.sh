#!/usr/bin/env bash
# Which lines of host code the tests run: a table by file and the total; fails below 90 %. Kernels are held by the oclgrind suite, and the
# slow references, which only tests call, are not counted. Builds everything anew and runs the whole suite hardly optimised: no part of
# .ci/run.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh
install_packages gcovr
configure coverage
build coverage
find "$builds/coverage" -name '*.gcda' -delete
# Instrumented objects name the folder of their counters, which one test forbids of what is installed.
ctest --test-dir "$builds/coverage" --output-on-failure -j "$(nproc)" -LE large -E 'NoInstalledFileNamesThePlace' "$@"
gcovr --root . --filter 'src/' --filter 'include/' --exclude 'src/reference/' --print-summary --fail-under-line 90 "$builds/coverage"
