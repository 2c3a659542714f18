#!/usr/bin/env bash
# Holds the working tree's benchmarks against a base commit's: bench/compare.sh BASE [BENCHMARK OPTIONS]
# Both are built, then run in turns. A benchmark's figure is the median over the turns of its fraction of the ceiling that
# was measured beside it, or of its rate by processor time where it has none. Slower by 5 % is a warning, by 15 % a failure.
# .ci/run calls it only where CLERESTORY_BASE names a commit: building the base takes minutes, the turns one.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh

[ $# -ge 1 ] || { echo "usage: bench/compare.sh BASE [BENCHMARK OPTIONS]" >&2; exit 2; }
base=$(git rev-parse --verify "$1^{commit}")
shift
turns=5
filter='^(write_points/random|build_tables/2048x1024|draw_samples/city_1024|shade_shared/1024|harmonic)/cores:[2-9]'

work=$(mktemp -d)
trap 'git worktree remove --force "$work/base" 2>/dev/null || true; rm -rf "$work"' EXIT
git worktree add --quiet --detach "$work/base" "$base"
for tree in . "$work/base"; do
    (cd "$tree" && configure release -DCLERESTORY_BENCH=ON && build release clerestory_bench)
done
for turn in $(seq $turns); do
    for side in base change; do
        tree=.
        [ $side = base ] && tree=$work/base
        "$tree/build/release/bench/clerestory_bench" --benchmark_filter="$filter" --benchmark_min_time=0.2 \
            --benchmark_out_format=json --benchmark_out="$work/$side.$turn.json" "$@" >/dev/null
    done
done

# name and figure of each benchmark of a side's turns, a line each
figures() {
    awk -F'[:,]' '
        /"name":/ { name = $0; sub(/.*"name": "/, "", name); sub(/".*/, "", name); delete value }
        /"(rate|of_ceiling)":/ { key = $1; gsub(/[ "]/, "", key); value[key] = $2 + 0 }
        /^    }/ && name != "" { print name, ("of_ceiling" in value ? value["of_ceiling"] : value["rate"]); name = "" }
    ' "$work/$1".*.json | sort -k1,1 -k2,2g
}
medians() { figures "$1" | awk '{ n[$1]++; v[$1, n[$1]] = $2 } END { for (k in n) print k, v[k, int((n[k] + 1) / 2)] }' | sort; }

join <(medians base) <(medians change) | awk '
    { change = $3 / $2 - 1; verdict = change < -0.15 ? "FAILED" : change < -0.05 ? "warning" : "" }
    { printf "%-50s %10.4g %10.4g %+6.1f %% %s\n", $1, $2, $3, 100 * change, verdict; failed += verdict == "FAILED" }
    END { if (NR == 0) print "the base has none of these benchmarks"; exit failed > 0 }'
