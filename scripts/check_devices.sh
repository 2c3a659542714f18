#!/usr/bin/env bash
# Every OpenCL runtime that can be had on one machine, tried and compared; --help says more.
set -euo pipefail
usage() {
    cat <<'END'
scripts/check_devices.sh [--keep FOLDER] [-o FILE]
scripts/check_devices.sh --from FOLDER [-o FILE]

Builds the committed tree in minimal systems of Debian 12 and 13, runs the kernels' tests, samples, pictures and timings there on every OpenCL
runtime that can be had, and writes a table. Runtimes: PoCL and Mesa's rusticl of both suites, PoCL laid out as for an accelerator, Intel's CPU
runtime and PoCL 3.0 from PyPI. Root or sudo, the network, 8 GB in $TMPDIR, and on two cores half an hour. A driver may fail: the table says
so. Fails itself where PoCL or Intel's runtime fails a test.

  --keep FOLDER  base systems, packages and what each runtime said stay there, the first two for the next run
  --from FOLDER  tries nothing: the table of what --keep left there, for other words about it
  -o FILE        the table, Markdown, in the place of the last one in it (default: stdout)

Example: scripts/check_devices.sh --keep /var/tmp/fresh -o docs/devices.md
END
}
keep="" from="" table=/dev/stdout
arguments=("$@")
while [ $# -gt 0 ]; do
    case $1 in
        --help) usage; exit 0 ;;
        --keep) keep=$(realpath -m -- "${2:?--keep: which folder?}"); shift ;;
        --from) from=$(realpath -e -- "${2:?--from: which folder?}"); shift ;;
        -o) table=$(realpath -m -- "${2:?-o: which file?}"); shift ;;
        *) echo "$1: no such flag; scripts/check_devices.sh --help says more" >&2; exit 2 ;;
    esac
    shift
done
if [ "$(id -u)" -ne 0 ]; then exec sudo -- "$(realpath "$0")" "${arguments[@]}"; fi
cd "$(dirname "$0")/.."
. scripts/prepare.sh
. scripts/minimal_system.sh
work=$(mktemp -d)
trap 'remove_systems; rm -rf "$work"' EXIT
tree=/srv/tree results=$work/results
mkdir "$results"

# pypi FOLDER PACKAGE...: what pip installs, in a virtual environment that is moved into the system; not its OpenCL loader.
pypi() {
    local folder=$1
    shift
    python3 -m venv "$work/venv" 2>/dev/null || { install_missing python3-venv; python3 -m venv "$work/venv"; }
    "$work/venv/bin/python" -m pip install -q --disable-pip-version-check "$@"
    rm -f "$work/venv/lib"/libOpenCL.so*
    mv "$work/venv" "$system$folder"
}

# builds SUITE [PACKAGE...]: a minimal system with the tree, built.
builds() {
    local suite=$1
    shift
    make_system "$suite" "$keep"
    mkdir "$system$tree"
    git archive HEAD | tar -C "$system$tree" -x
    in_system "$system" env -C "$tree" bash -ec '
        . scripts/prepare.sh
        install_packages "$@" >/dev/null
        configure release
        build release' build "$@"
}

# tries NAME ICD [VARIABLE=VALUE...] [-- FLAG...]: ICD is the driver's library, as the loader is told.
tries() {
    local name=$1 icd=$2 variables=() began=$SECONDS
    shift 2
    while [ $# -gt 0 ] && [ "$1" != -- ]; do variables+=("$1"); shift; done
    if [ $# -gt 0 ]; then shift; fi
    rm -rf "$system/srv/icd"
    mkdir "$system/srv/icd"
    echo "$icd" >"$system/srv/icd/one.icd"
    in_system "$system" env -C "$tree" OCL_ICD_VENDORS=/srv/icd "${variables[@]}" \
        scripts/try_device.sh "$tree/${builds#./}/release" "/srv/$name" "$@" >/dev/null 2>&1 || true
    mv "$system/srv/$name" "$results/$name"
    if [ -n "$keep" ]; then
        mkdir -p "$keep/devices"
        rm -rf "$keep/devices/$name"
        cp -r "$results/$name" "$keep/devices/"
    fi
    echo "$name: tried in $((SECONDS - began)) s" >&2
}

# The path of the driver's library that a package's .icd file names.
icd_of() { cat "$system/etc/OpenCL/vendors/$1"; }

try_all() {
    builds bookworm mesa-opencl-icd
    bookworm=$system
    pypi /opt/intel intel-opencl-rt intel-cmplr-lib-rt
    pypi /opt/pocl pocl-binary-distribution
    tries pocl-bookworm "$(icd_of pocl.icd)"
    tries pocl-bookworm-as-accelerator "$(icd_of pocl.icd)" -- --act-as accelerator
    tries intel /opt/intel/lib/libintelocl.so LD_LIBRARY_PATH=/opt/intel/lib
    tries pocl-pypi "$(cd "$system" && find opt/pocl -name 'libpocl*.so' | sed 's|^|/|' | head -n 1)"
    tries rusticl-bookworm "$(icd_of rusticl.icd)" RUSTICL_ENABLE=llvmpipe
    builds trixie mesa-opencl-icd
    tries pocl-trixie "$(icd_of pocl.icd)"
    tries rusticl-trixie "$(icd_of rusticl.icd)" RUSTICL_ENABLE=llvmpipe
    system=$bookworm
}

# relative_rmse A B: of two pictures, as `compare` prints it.
if [ -n "$from" ]; then
    results=$from/devices
    build release clerestory
    relative_rmse() { "$builds/release/clerestory" compare "$1" "$2" | sed -nE 's/^rel rmse +//p'; }
else
    try_all
    relative_rmse() {
        cp "$1" "$system/srv/a.exr"
        cp "$2" "$system/srv/b.exr"
        in_system "$system" "$tree/${builds#./}/release/clerestory" compare /srv/a.exr /srv/b.exr | sed -nE 's/^rel rmse +//p'
    }
fi

# value FILE KEY: of the first line `"KEY": value` of a JSON file; nothing where it has none.
value() { sed -nE "s/^ *\"$2\": \"?([^\",]*)\"?,?$/\1/p;" "$1" 2>/dev/null | head -n 1; }

# milliseconds FILE KEY: of "seconds" in a report.
milliseconds() { value "$1" "$2" | awk '{ printf "%.1f", 1000 * $1 } END { if (!NR) printf "–" }'; }

# tests NAME: how many passed, and which failed.
tests() {
    local passed failed
    passed=$(sed -nE 's/^\[  PASSED  \] ([0-9]+) tests?\.$/\1/p' "$results/$1/tests.txt")
    if [ -z "$passed" ]; then
        echo "none: exit status $(cat "$results/$1/tests.status")"
        return
    fi
    failed=$(sed -nE 's/^\[  FAILED  \] ([0-9]+) tests?, listed below:$/\1/p' "$results/$1/tests.txt")
    echo "$passed of $((passed + ${failed:-0}))"
}

# same_bits NAME: whether the goldens of tables and draws hold.
same_bits() { grep -q '^\[       OK \] Golden.TablesAndDraws' "$results/$1/tests.txt" && echo yes || echo no; }

# worst_picture NAME: the largest relative RMSE against PoCL's of the same name, and how many pictures there are.
worst_picture() {
    local picture worst=0 error count=0
    for picture in "$results"/pocl-bookworm/*.exr; do
        [ -e "$results/$1/${picture##*/}" ] || continue
        error=$(relative_rmse "$results/$1/${picture##*/}" "$picture")
        worst=$(echo "$worst $error" | awk '{ print ($2 > $1 ? $2 : $1) }')
        count=$((count + 1))
    done
    if [ "$count" -eq 0 ]; then echo "– (none)"; else echo "$worst ($count)"; fi
}

# verdict NAME: what `devices` says.
verdict() {
    local text
    text=$(sed -nE 's/^ *"verdict": "(.*)",?$/\1/p' "$results/$1/devices.json" 2>/dev/null | head -n 1)
    [ -n "$text" ] || text="\`devices\` ends with $(cat "$results/$1/devices.status"): $(tail -n 1 "$results/$1/devices.txt")"
    echo "$text"
}

row() {
    local name=$1 title=$2 of=$results/$1
    echo "| $title | $(value "$of/devices.json" driver) | $(verdict "$name") | $(tests "$name") |" \
        "$(same_bits "$name") | $(worst_picture "$name") | $(milliseconds "$of/shared.json" tables) | $(milliseconds "$of/shared.json" draw) |" \
        "$(milliseconds "$of/shared.json" shade) | $(milliseconds "$of/exact.json" shade) |"
}

{
    echo "| runtime | driver | \`devices\` | kernels' tests passed | tables and draws the same bits | pictures: worst relative RMSE | tables ms | draw ms | shade ms | exact ms |"
    echo "|---|---|---|---|---|---|---|---|---|---|"
    row pocl-bookworm "PoCL, Debian 12"
    row pocl-bookworm-as-accelerator "the same, laid out as for an accelerator"
    row pocl-trixie "PoCL, Debian 13"
    row intel "Intel's CPU runtime, PyPI"
    row pocl-pypi "PoCL, PyPI"
    row rusticl-bookworm "Mesa's rusticl on llvmpipe, Debian 12"
    row rusticl-trixie "Mesa's rusticl on llvmpipe, Debian 13"
} >"$work/table.md"
{
    echo "Made by \`scripts/check_devices.sh\` on $(date -u +%Y-%m-%d) at commit $(git rev-parse --short=12 HEAD), on" \
        "$(nproc) cores of $(sed -nE '0,/^model name/s/^model name[^:]*: *//p' /proc/cpuinfo)."
    echo
    cat "$work/table.md"
} >"$work/page.md"
# What a page says before its table stays.
if [ -f "$table" ]; then sed '/^Made by /,$d' "$table" >"$work/before.md"; else : >"$work/before.md"; fi
cat "$work/before.md" "$work/page.md" >"$table"
for name in pocl-bookworm pocl-bookworm-as-accelerator pocl-trixie intel; do
    if [ "$(cat "$results/$name/tests.status")" -ne 0 ]; then
        echo "$name: $(sed -nE 's/^\[  FAILED  \] (.*) \([0-9]+ ms\)$/\1/p' "$results/$name/tests.txt" | sort -u | tr '\n' ' ')" >&2
        exit 1
    fi
done
