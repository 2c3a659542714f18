#!/usr/bin/env bash
# Runs the program on tiny inputs under oclgrind: races, bounds, uninitialised reads, API misuse in every kernel.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh
install_packages oclgrind
configure release -DCLERESTORY_TESTS=ON -DCLERESTORY_BENCH=ON
build release clerestory_tests
log=$(mktemp)
trap 'rm -f "$log"' EXIT
CLERESTORY_TINY=1 oclgrind --data-races --uninitialized --check-api --log "$log" \
    build/release/tests/clerestory_tests --gtest_brief=1 --gtest_filter='Tiny*'
if [ -s "$log" ]; then
    cat "$log" >&2
    exit 1
fi
