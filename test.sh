#!/usr/bin/env bash
# Installs what the tests need (Debian 12 or 13), builds, and passes every test. Arguments go to ctest: ./test.sh -R Stage2Cdf
# CLERESTORY_BUILD_DIR names a folder to build in instead of build/.
set -euo pipefail
cd "$(dirname "$0")"
. scripts/prepare.sh

install_missing $(packages_for run test)
configure release -DCLERESTORY_TESTS=ON -DCLERESTORY_BENCH=ON
build release
ctest --test-dir "$builds/release" --output-on-failure -j "$(nproc)" -LE large "$@"
