#!/usr/bin/env bash
# The two commands of the README on machines that have nothing; --help says more.
set -euo pipefail
usage() {
    cat <<'END'
scripts/check_fresh.sh [--keep FOLDER] [--only run|test] SUITE...

Makes a minimal system of each Debian suite (debootstrap, minbase), unpacks the committed tree in it and nothing else, in a folder with a
blank in its name, and does there what the README says: ./run.sh, then ./test.sh; as root, with an empty HOME, no locale, no terminal. Says
how long each took, what run.sh installed, and the last 40 lines of what failed. Exit codes: 0 all passed, 1 something failed, 2 usage.
Root or sudo, the network, 4 GB in $TMPDIR, and on two cores a quarter of an hour a suite.

  --keep FOLDER     base systems, packages and logs stay there, the first two for the next run
  --only run|test   one of the two commands

Example: scripts/check_fresh.sh --keep /var/tmp/fresh bookworm trixie
END
}
fail_usage() {
    echo "$1; scripts/check_fresh.sh --help says more" >&2
    exit 2
}
keep="" commands="run test" suites=()
arguments=("$@")
while [ $# -gt 0 ]; do
    case $1 in
        --help) usage; exit 0 ;;
        --keep | --only)
            [ $# -gt 1 ] || fail_usage "$1: what?"
            if [ "$1" = --keep ]; then keep=$(realpath -m -- "$2"); else commands=$2; fi
            shift ;;
        -*) fail_usage "$1: no such flag" ;;
        *) suites+=("$1") ;;
    esac
    shift
done
case $commands in "run test" | run | test) ;; *) fail_usage "--only $commands: takes run or test" ;; esac
[ ${#suites[@]} -gt 0 ] || fail_usage "no suite named"
if [ "$(id -u)" -ne 0 ]; then exec sudo -- "$(realpath "$0")" "${arguments[@]}"; fi
cd "$(dirname "$0")/.."
. scripts/prepare.sh
. scripts/minimal_system.sh

checkout="/srv/a checkout"
failed=no
logs=$(mktemp -d)
trap 'remove_systems; rm -rf "$logs"' EXIT

# failure TEXT [LOG]: counts and tells it, with the end of what was said.
failure() {
    failed=yes
    echo "$suite: FAILED: $1"
    if [ $# -gt 1 ]; then tail -n 40 "$2" | sed 's/^/    /'; fi
}

# step NAME: runs ./NAME.sh in the checkout; its words go to $log. Succeeds where the command did.
step() {
    local status=0 began=$SECONDS
    log=$logs/$suite-$1.log
    in_system "$system" env -C "$checkout" "./$1.sh" >"$log" 2>&1 || status=$?
    echo "$suite: ./$1.sh: exit status $status after $((SECONDS - began)) s"
    if [ "$status" -ne 0 ]; then failure "./$1.sh" "$log"; fi
    if grep -q 'warning:' "$log"; then failure "warnings: $(grep -m 5 'warning:' "$log")"; fi
    if [ -n "$keep" ]; then cp "$log" "$keep/"; fi
    return "$status"
}

# NAME VERSION KIB of what is installed.
installed() {
    in_system "$system" dpkg-query -W -f='${db:Status-Status} ${binary:Package} ${Version} ${Installed-Size}\n' | sed -n 's/^installed //p' | sort
}

# What has been installed since the list BEFORE; a Qt or an X server among it is a failure.
tell_what_came() {
    local came=$logs/came kib bytes
    comm -13 "$1" <(installed) >"$came"
    bytes=$(in_system "$system" apt-cache show $(awk '{ print $1 "=" $2 }' "$came") | awk '/^Size:/ { sum += $2 } END { print sum }')
    kib=$(awk '{ sum += $3 } END { print sum }' "$came")
    echo "$suite: run.sh installed $(wc -l <"$came") packages, $((bytes / 1000000)) MB downloaded, $((kib * 1024 / 1000000)) MB on disk; the largest:"
    sort -k3,3nr "$came" | head -n 10 | awk '{ printf "    %4d MB  %s %s\n", $3 * 1024 / 1e6, $1, $2 }'
    echo "    X11's client libraries, for gnuplot's and OpenImageIO's libraries:" \
        $(sed -nE 's/^(lib(x11|xcb|xau|xdmcp|xext|xfixes|xrender|xxf86|xshmfence|ice|sm)[^ :]*).*/\1/p' "$came")
    if grep -E '^(lib)?(qt[0-9]|kf[0-9])|^(xserver|xorg|xvfb|xwayland|xnest|xephyr)' "$came"; then failure "run.sh installs a Qt or an X server"; fi
}

# The page of figures and every picture that its report names.
check_figures() {
    local folder=$system$checkout/out/reproduce picture count=0
    if [ ! -s "$folder/index.html" ]; then failure "no out/reproduce/index.html"; fi
    while read -r picture; do
        if [ -s "$folder/$picture" ]; then count=$((count + 1)); else failure "no out/reproduce/$picture"; fi
    done < <(sed -nE 's/^ *"file": "([^"]*\.(png|svg))",?$/\1/p' "$folder/report.json")
    if [ "$count" -eq 0 ]; then failure "no pictures in out/reproduce"; fi
    echo "$suite: out/reproduce: index.html and $count pictures"
}

# What ctest says it ran: at least as many as are written down here.
check_tests() {
    local written ran
    written=$(grep -hE '^TEST(_F|_P)?\(' tests/*_test.cpp | wc -l)
    ran=$(sed -nE 's/^[0-9]+% tests passed, [0-9]+ tests failed out of ([0-9]+)$/\1/p' "$log")
    echo "$suite: ctest ran ${ran:-0} tests"
    if [ "${ran:-0}" -lt "$written" ]; then failure "fewer than the $written tests of tests/"; fi
    sed -nE 's/^.*Test +#[0-9]+: (.*[^.]) \.+\*\*\*Skipped.*$/    skipped: \1/p' "$log"
}

for suite in "${suites[@]}"; do
    began=$SECONDS
    if ! make_system "$suite" "$keep"; then failure "debootstrap"; continue; fi
    mkdir "$system$checkout"
    git archive HEAD | tar -C "$system$checkout" -x
    echo "$suite: minimal system with the tree of $(git rev-parse --short=12 HEAD) after $((SECONDS - began)) s"
    installed >"$logs/before"
    if [ "$commands" != test ] && step run; then
        check_figures
        tell_what_came "$logs/before"
    fi
    if [ "$commands" != run ] && step test; then check_tests; fi
    remove_systems
done
[ "$failed" = no ] || exit 1
echo "All passed."
