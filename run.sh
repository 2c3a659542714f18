#!/usr/bin/env bash
# Installs what Clerestory needs (Debian 12 or 13), builds it, and does the main job: every figure of the course report on a bundled map,
# in out/reproduce. Arguments go to `clerestory reproduce`: ./run.sh my_map.exr --flip-y -o my_figures
# CLERESTORY_BUILD_DIR names a folder to build in instead of build/, for a checkout that cannot be written to: figures go to reproduce/ there.
set -euo pipefail
start=$PWD
cd "$(dirname "$0")"
. scripts/prepare.sh

install_missing $(packages_for run)
configure release -DCLERESTORY_TESTS=OFF -DCLERESTORY_BENCH=OFF
build release
program=$(realpath "$builds/release/clerestory")
if [ $# -eq 0 ]; then
    if [ -n "${CLERESTORY_BUILD_DIR:-}" ]; then set -- -o "$builds/reproduce"; else set -- -o out/reproduce; fi
else
    cd "$start"
fi
"$program" reproduce "$@"
