#!/usr/bin/env bash
# The tests of 16384x8192 maps, which the default suite leaves out, in the build of ./test.sh.
set -euo pipefail
cd "$(dirname "$0")/.."
exec ctest --test-dir "${CLERESTORY_BUILD_DIR:-build}/release" --output-on-failure -L large
