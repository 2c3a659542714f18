#!/usr/bin/env bash
# Tries one OpenCL runtime, the only one that the loader finds, for scripts/check_devices.sh: the kernels' tests, pictures and samples to
# compare, and the time of each stage. A driver may crash or hang in any of it: what it got to is kept.
#   scripts/try_device.sh BUILD OUT [FLAG...]   flags go to every command: --act-as accelerator
set -uo pipefail
build=$1 out=$2
shift 2
flags=("$@")
program=$build/clerestory
mkdir -p "$out"
export CLERESTORY_CACHE_DIR=$out/cache POCL_CACHE_DIR=$out/pocl
mkdir -p "$POCL_CACHE_DIR"
case " $* " in *" --act-as "*) export CLERESTORY_TEST_ACT_AS=${*: -1} ;; esac

run() { timeout 300 "$@"; }

run "$program" devices "${flags[@]}" --json "$out/devices.json" >"$out/devices.txt" 2>&1
echo "$?" >"$out/devices.status"
filter='Tiny*:*Stage1*:*Stage2*:*Stage3*:*Stage4*:Lights*:*Exact*:*Harmonic*:Golden*:*LatLong*:DisplayTest*:Cl*:*Sequence*:Fresnel*'
filter+='-SequenceError*:FresnelCommand*:TableArithmetic*'
timeout 1800 "$build/tests/clerestory_tests" --gtest_filter="$filter" >"$out/tests.txt" 2>&1
echo "$?" >"$out/tests.status"
for map in city interior sunset; do
    run "$program" sample "data/$map.exr" "${flags[@]}" -q -n 1024 -o "$out/$map" >"$out/sample.txt" 2>&1 && rm -f "$out/$map"/*.png
    for estimator in shared per-pixel harmonic exact; do
        run "$program" render "data/$map.exr" "${flags[@]}" -q -n 32 --estimator "$estimator" -o "$out/${map}_$estimator.exr" >"$out/render.txt" 2>&1
    done
done
# Seconds of each stage, of the fifth run: programs are built by then.
for _ in 1 2 3 4 5; do
    run "$program" render data/city.exr "${flags[@]}" -n 262144 --control-degree 0 -o "$out/timed.exr" --json "$out/shared.json" >"$out/render.txt" 2>&1
    run "$program" render data/city.exr "${flags[@]}" --estimator exact -o "$out/timed.exr" --json "$out/exact.json" >>"$out/render.txt" 2>&1
done
rm -rf "$out/timed.exr" "$out/cache" "$out/pocl"
