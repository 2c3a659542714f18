#!/usr/bin/env bash
# What `batch` promises, at full size: rate, memory, death, full disks. Minutes, and it wants an idle machine; the tests hold smaller
# versions of all but the rate.
#   scripts/check_batch.sh [FOLDER OF THE BUILD] [rate memory kill disk]
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:-build/release}
program=$PWD/$folder/clerestory
[ $# -gt 0 ] && shift
checks=${*:-rate memory kill disk}
data=$PWD/data
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
status=0
verdict() { # NAME FIGURE OPERATOR BOUND
    if awk "BEGIN { exit !($2 $3 $4) }"; then echo "  $1: $2 ($3 $4)"; else echo "  $1: $2, not $3 $4" && status=1; fi
}
number() { grep -o "\"$2\": [0-9.e+-]*" "$1" | head -n 1 | sed 's/.*: //'; }
sums() { (cd "$1" && find . -type f ! -name '*.json' | sort | xargs -r sha256sum); }
seconds_now() { date +%s.%N; }
cpu_of() { # user and system seconds of a command; its own output is dropped
    { TIMEFORMAT='%U %S'; time "$@" >/dev/null 2>/dev/null; } 2>&1 | awk '{ print $1 + $2 }'
}

rate() {
    # Six parts of 60 frames, by turns with as many processes, so that a busy machine slows both.
    local batch=0 alone=0 batch_cpu=0 alone_cpu=0 part begin
    turntable() { # FROM TO
        cat >"$work/turntable.toml" <<END
[[job]]
map = "$data/city.exr"
samples = 1024
rotate_y = {from = $1, to = $2}
output = ["{map}_{rotation:03}.exr", "{map}_{rotation:03}.png"]
END
    }
    alone() {
        local frame
        for frame in $(seq "$1" "$2"); do
            "$program" render "$data/city.exr" -n 1024 --rotate-y "$frame" -q -o "$work/alone/$frame.exr" -o "$work/alone/$frame.png"
        done
    }
    add() { awk "BEGIN { printf \"%.3f\", $1 + $2 }"; }
    turntable 0 3 && "$program" batch "$work/turntable.toml" -o "$work/rate" -q && alone 0 1
    for part in 0 60 120 180 240 300; do
        turntable "$part" $((part + 59))
        begin=$(seconds_now)
        batch_cpu=$(add "$batch_cpu" "$(cpu_of "$program" batch "$work/turntable.toml" -o "$work/rate" -q)")
        batch=$(add "$batch" "$(seconds_now) - $begin")
        begin=$(seconds_now)
        alone_cpu=$(add "$alone_cpu" "$(cpu_of alone "$part" $((part + 59)))")
        alone=$(add "$alone" "$(seconds_now) - $begin")
    done
    turntable 0 359
    begin=$(seconds_now)
    "$program" batch "$work/turntable.toml" -o "$work/rate" -q
    local whole
    whole=$(add "$(seconds_now)" "-$begin")
    echo "rate: 360 frames, 511 x 511, 1024 shared samples, EXR and PNG"
    echo "  one batch: $whole s wall; in six: $batch s wall, $batch_cpu s of processor; 360 processes: $alone s wall, $alone_cpu s of processor"
    verdict "frames a second" "$(awk "BEGIN { printf \"%.1f\", 360 / $whole }")" ">=" 20
    verdict "times the rate of single processes" "$(awk "BEGIN { printf \"%.2f\", $alone / $batch }")" ">=" 3
}

memory() {
    local map names=(city interior sunset)
    mkdir -p "$work/maps"
    for map in $(seq -w 20); do cp "$data/${names[$((10#$map % 3))]}.exr" "$work/maps/m$map.exr"; done
    jobs() { # MAPS LAST
        cat >"$work/memory.toml" <<END
[[job]]
map = "$work/maps/$1.exr"
samples = 256
rotate_y = {from = 0, to = $2}
output = ["{map}_{rotation:03}.exr", "{map}_{rotation:03}.png"]
END
        exec "$program" batch "$work/memory.toml" -o "$work/memory" -q
    }
    # Growth is looked for within one run, from the peak of each hundred jobs to that of the next: two runs differ by how their threads
    # meet, and so do the highest peaks of few jobs and of many.
    local one thousand process count peaks=()
    (jobs m01 0)
    one=$(number "$work/memory/batch.json" peak_memory_bytes)
    rm -rf "$work/memory"
    jobs 'm*' 49 &
    process=$!
    for count in $(seq 100 100 1000); do
        while kill -0 "$process" 2>/dev/null && [ "$(find "$work/memory" -name '*.png' 2>/dev/null | wc -l)" -lt "$count" ]; do sleep 0.05; done
        peaks+=("$(awk '/VmHWM/ { print $2 * 1024 }' "/proc/$process/status" 2>/dev/null || true)")
        echo 5 2>/dev/null >"/proc/$process/clear_refs" || true # the next peak is counted anew
    done
    wait "$process"
    peaks[9]=${peaks[9]:-$(number "$work/memory/batch.json" peak_memory_bytes)} # the process may have ended by then
    rm -rf "$work/memory"
    thousand=$(printf '%s\n' "${peaks[@]}" | sort -n | tail -n 1)
    echo "memory: 20 maps of 1024 x 512; bytes at the peak: $one of 1 job; of each hundred of 1000 jobs ${peaks[*]}"
    verdict "1000 jobs over one" "$(awk "BEGIN { printf \"%.3f\", $thousand / $one }")" "<=" 1.2
    verdict "the last 300 jobs over the first 300" \
        "$(awk "BEGIN { printf \"%.3f\", (${peaks[7]} + ${peaks[8]} + ${peaks[9]}) / (${peaks[0]} + ${peaks[1]} + ${peaks[2]}) }")" "<=" 1.01
}

kill_and_resume() {
    pictures() { # FOLDER, what to do with each
        find "$1" \( -name '*.exr' -o -name '*.png' \) ! -name '.*' "${@:2}"
    }
    # Of jobs whose two files stood before: files that are others now, by their inodes.
    local rewritten='
        function job(file) { sub(/\.(exr|png)$/, "", file); return file }
        NR == FNR { now[$1] = $2; next }
        { before[$1] = $2; files[job($1)]++ }
        END { for (file in before) if (files[job(file)] == 2 && now[file] != before[file]) count++; print count + 0 }'
    cat >"$work/kill.toml" <<END
[[job]]
map = "$data/*.exr"
size = 255
samples = 256
rotate_y = {from = 0, to = 357, step = 3}
output = ["{map}_{rotation:03}.exr", "{map}_{rotation:03}.png"]
END
    local begin whole kills=0 rounds=0 changed=0 torn=0
    "$program" batch "$work/kill.toml" -o "$work/whole" -q
    begin=$(seconds_now)
    "$program" batch "$work/kill.toml" -o "$work/whole" -q
    whole=$(awk "BEGIN { print $(seconds_now) - $begin }")
    sums "$work/whole" >"$work/whole.sums"
    RANDOM=1
    while [ "$kills" -lt 50 ]; do
        # Deaths a fifth of the whole apart on average: ten or so a batch, then a fresh one.
        rounds=$((rounds + 1))
        rm -rf "$work/killed" && mkdir "$work/killed" && : >"$work/before"
        while [ "$kills" -lt 50 ]; do
            "$program" batch "$work/kill.toml" -o "$work/killed" -q --resume 2>/dev/null &
            local process=$!
            sleep "$(awk "BEGIN { print 0.1 + $RANDOM / 32768 * $whole * 0.4 }")"
            if ! kill -9 "$process" 2>/dev/null; then break; fi
            { wait "$process" || true; } 2>/dev/null
            kills=$((kills + 1))
            pictures "$work/killed" -printf '%p %i\n' >"$work/now"
            changed=$((changed + $(awk "$rewritten" "$work/now" "$work/before")))
            torn=$((torn + $(cd "$work/killed" && pictures . -exec sha256sum {} + | awk 'NR == FNR { whole[$0]; next } !($0 in whole)' "$work/whole.sums" - | wc -l)))
            cp "$work/now" "$work/before"
        done
        "$program" batch "$work/kill.toml" -o "$work/killed" -q --resume
        sums "$work/killed" >"$work/killed.sums"
        cmp "$work/whole.sums" "$work/killed.sums" || { echo "  other files than an undisturbed run's" && status=1; }
    done
    echo "kill: 360 jobs in $whole s, killed $kills times over $rounds batches, and resumed: every file as in an undisturbed run"
    verdict "files that differed after a kill" "$torn" "==" 0
    verdict "files of finished jobs written again" "$changed" "==" 0
}

disk() {
    mkdir -p "$work/small"
    if ! mount -t tmpfs -o size=11m none "$work/small" 2>/dev/null; then
        echo "disk: no right to mount a small file system; left out"
        return
    fi
    cat >"$work/disk.toml" <<END
[[job]]
map = "$data/city.exr"
samples = 64
rotate_y = {from = 0, to = 9}
output = "{rotation}.exr"
END
    local code=0
    "$program" batch "$work/disk.toml" -o "$work/small" -q --json "$work/disk.json" 2>"$work/disk.err" || code=$?
    local left
    left=$(find "$work/small" -name '.clerestory-*' | wc -l)
    echo "disk: 10 pictures of 4.2 MB onto a disk of 11 MB: exit code $code, $(number "$work/disk.json" done) done, $(number "$work/disk.json" failed) failed"
    verdict "failed jobs" "$(number "$work/disk.json" failed)" "==" 8
    verdict "leftovers" "$left" "==" 0
    mount -o remount,size=100m "$work/small"
    "$program" batch "$work/disk.toml" -o "$work/small" -q --resume --json "$work/disk.json"
    verdict "skipped when there is room" "$(number "$work/disk.json" skipped)" "==" 2
    verdict "done when there is room" "$(number "$work/disk.json" done)" "==" 8
    umount "$work/small"
}

for check in $checks; do
    case $check in
        kill) kill_and_resume ;;
        rate | memory | disk) "$check" ;;
        *) echo "$check: no such check" >&2 && exit 2 ;;
    esac
done
exit "$status"
