# Shared by run.sh, test.sh, .ci/run and bench/run.sh: packages and builds. Sourced from the repository's root.

# Each preset is built in a folder of its name here; a relative one is seen from the repository's root.
builds=${CLERESTORY_BUILD_DIR:-build}

# The packages of packages.txt that stand below the headings named: run, test.
packages_for() {
    awk -v wanted=" $* " '/^# [a-z]+:/ { heading = substr($2, 1, length($2) - 1) } !/^#/ && NF && index(wanted, " " heading " ") { print $1 }' packages.txt
}

# Those of the named packages that are not installed yet.
missing_packages() {
    local package
    for package in "$@"; do
        dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed || echo "$package"
    done
}

# Installs which of the named packages are missing; quick and silent where none is.
install_missing() {
    if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
        echo "This is no Debian system: install what packages.txt names by your own means, then run cmake --preset release." >&2
        exit 2
    fi
    local missing
    missing=$(missing_packages "$@")
    if [ -z "$missing" ]; then return; fi
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then
        if ! command -v sudo >/dev/null; then
            echo "Not root and no sudo: run this as root: apt-get install --no-install-recommends" $missing >&2
            exit 2
        fi
        as_root=(sudo)
    fi
    echo "Installing:" $missing
    export DEBIAN_FRONTEND=noninteractive
    "${as_root[@]}" apt-get update -qq
    "${as_root[@]}" apt-get install -y -qq --no-install-recommends $missing >/dev/null
}

# Installs all of packages.txt and the packages named.
install_packages() {
    install_missing $(packages_for run test) "$@"
}

# configure PRESET [CMAKE OPTIONS]: quiet unless it fails. Files are compiled eight at a time: whole builds take a third of the
# time, for heavy headers are read once. Whoever edits and builds again calls cmake --preset by hand, without that.
configure() {
    local log
    log=$(mktemp)
    if ! cmake --preset "$@" -B "$builds/$1" -DCMAKE_UNITY_BUILD=ON >"$log" 2>&1; then
        cat "$log" >&2
        rm -f "$log"
        exit 1
    fi
    rm -f "$log"
}

# build PRESET [TARGETS]: shows progress on a terminal only.
build() {
    local preset=$1
    shift
    local targets=()
    [ $# -gt 0 ] && targets=(--target "$@")
    cmake --build "$builds/$preset" "${targets[@]}" -- --quiet
}
