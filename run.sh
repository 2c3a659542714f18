#!/usr/bin/env bash
# Installs what Clerestory needs (Debian 12), builds it, and does the main job: every figure of the course report on a bundled map.
# Arguments go to `clerestory reproduce`: ./run.sh my_map.exr --flip-y -o my_figures
set -euo pipefail
cd "$(dirname "$0")"
. scripts/prepare.sh

install_missing $(packages_for run)
configure release -DCLERESTORY_TESTS=OFF -DCLERESTORY_BENCH=OFF
build release
if [ $# -eq 0 ]; then set -- -o out/reproduce; fi
build/release/clerestory reproduce "$@"
