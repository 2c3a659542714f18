#!/usr/bin/env bash
# Runs every kernel on tiny inputs under oclgrind: races, bounds, uninitialised reads, API misuse. A kernel that no tiny
# input reaches is an error too.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh
install_packages oclgrind
configure release -DCLERESTORY_TESTS=ON -DCLERESTORY_BENCH=ON
build release clerestory_tests
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cc -shared -fPIC -Wall -Wextra -o "$work/oclgrind_shim.so" scripts/oclgrind_shim.c -ldl

# oclgrind puts its own OpenCL before the loader's: the tests see one device, which interprets the kernels. It knows
# neither what clang's optimiser makes of them (freeze, bitreverse) nor what forced inlining leaves behind. It starts its
# log anew with every context, so findings are taken from stderr, where nothing else goes.
status=0
oclgrind --data-races --uninitialized --check-api --inst-counts --build-options "-cl-opt-disable -DINLINE=static" \
    sh -c 'LD_PRELOAD="$1:$LD_PRELOAD" exec "$3" --gtest_brief=1 --gtest_filter="$2"' \
    tiny "$work/oclgrind_shim.so" 'Tiny*:SequencePhilox*' "$builds/release/tests/clerestory_tests" \
    >"$work/output" 2>"$work/findings" || status=$?
if [ "$status" -ne 0 ] || [ -s "$work/findings" ]; then
    grep -vE '^ *[0-9,]+ - |^Instructions executed|^$' "$work/output" >&2 || true
    cat "$work/findings" >&2
    exit 1
fi
sed -n "s/^Instructions executed for kernel '\(.*\)':/\1/p" "$work/output" | sort -u >"$work/run"
sed -nE 's/^(__)?kernel void ([a-z0-9_]+)\(.*/\2/p' kernels/*.cl | sort -u >"$work/written"
if missing=$(comm -13 "$work/run" "$work/written") && [ -n "$missing" ]; then
    echo "kernels that no test of the suite Tiny (tests/tiny_test.cpp) runs:" $missing >&2
    exit 1
fi
echo "oclgrind: $(wc -l <"$work/run") kernels, no finding"
