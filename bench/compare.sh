#!/usr/bin/env bash
# Holds the working tree's benchmarks against a base commit's: bench/compare.sh BASE [BENCHMARK OPTIONS]
# Both are built, then run in turns. A benchmark's figure is its fraction of the ceiling that was measured beside it, or its rate by
# processor time where it has none; what counts is the median over the turns of the change's figure over the base's of the same turn,
# because a shared machine's speed drifts. Slower by 5 % is a warning, by 15 % a failure, where all turns but one agree that it is slower.
# .ci/run calls it only where CLERESTORY_BASE names a commit: building the base takes minutes, the turns one.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh
builds=build # of either tree

[ $# -ge 1 ] || { echo "usage: bench/compare.sh BASE [BENCHMARK OPTIONS]" >&2; exit 2; }
base=$(git rev-parse --verify "$1^{commit}")
shift
turns=9
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

# turn, name and figure of each benchmark of a side, a line each
figures() {
    for turn in $(seq $turns); do
        awk -F'[:,]' -v turn="$turn" '
            /"name":/ { name = $0; sub(/.*"name": "/, "", name); sub(/".*/, "", name); delete value }
            /"(rate|of_ceiling)":/ { key = $1; gsub(/[ "]/, "", key); value[key] = $2 + 0 }
            /^    }/ && name != "" { print turn ":" name, ("of_ceiling" in value ? value["of_ceiling"] : value["rate"]); name = "" }
        ' "$work/$1.$turn.json"
    done | sort -k1,1
}

# benchmark, ratio of a turn; sorted, so that the middle one is the median
join <(figures base) <(figures change) | awk '{ sub(/^[0-9]*:/, "", $1); print $1, $3 / $2 }' | sort -k1,1 -k2,2g | awk '
    function tell(  ratio, agreed, verdict) {
        if (n == 0) return
        ratio = r[int((n + 1) / 2)]
        agreed = n < 2 || r[n - 1] < 1
        verdict = agreed && ratio < 0.85 ? "FAILED" : agreed && ratio < 0.95 ? "warning" : ""
        printf "%-50s %+6.1f %%  (turns %+.1f .. %+.1f) %s\n", name, 100 * (ratio - 1), 100 * (r[1] - 1), 100 * (r[n] - 1), verdict
        failed += verdict == "FAILED"
    }
    $1 != name { tell(); name = $1; n = 0 }
    { r[++n] = $2 }
    END { if (NR == 0) print "the base has none of these benchmarks"; tell(); exit failed > 0 }'
