#!/usr/bin/env bash
# Installs what the benchmarks need (Debian 12 or 13), builds them, prints one table and writes bench/results/latest.json.
# Arguments go to the benchmarks: bench/run.sh --benchmark_filter=draw_samples
# CLERESTORY_BENCH_NAME names the file of results; CLERESTORY_BENCH_MAP a map, stored bottom-up, for whole processes to render
# in place of the bundled one.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh

install_packages libtbb-dev libboost-dev openimageio-tools
configure release -DCLERESTORY_BENCH=ON
build release clerestory_bench clerestory_oiio
mkdir -p bench/results
results="bench/results/${CLERESTORY_BENCH_NAME:-latest}.json"
"$builds/release/bench/clerestory_bench" --benchmark_min_time=0.05 --benchmark_out_format=json --benchmark_out="$results" "$@"
sed -i '/"executable":/d; /"host_name":/d' "$results"  # nobody else's concern
