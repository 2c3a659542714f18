#!/usr/bin/env bash
# The Debian packages, made in a minimal system of a suite and used in another; --help says more.
set -euo pipefail
usage() {
    cat <<'END'
scripts/check_package.sh [--keep FOLDER] SUITE...

Builds the Debian packages of the committed tree in a minimal system of each Debian suite (debootstrap, minbase), leaves them in
build/package/SUITE, asks lintian about them, installs them with apt in another minimal system of the suite, and uses them there as somebody
would who has nothing else: scripts/use_package.sh. DEBFULLNAME and DEBEMAIL name the maintainer. Root, the network, 4 GB in $TMPDIR, and on
two cores six minutes a suite.

  --keep FOLDER     base systems and packages stay there for the next run

Example: scripts/check_package.sh bookworm trixie
END
}
fail_usage() {
    echo "$1; scripts/check_package.sh --help says more" >&2
    exit 2
}
keep="" suites=()
while [ $# -gt 0 ]; do
    case $1 in
        --help) usage; exit 0 ;;
        --keep)
            [ $# -gt 1 ] || fail_usage "$1: what?"
            keep=$(realpath -m -- "$2")
            shift ;;
        -*) fail_usage "$1: no such flag" ;;
        *) suites+=("$1") ;;
    esac
    shift
done
[ ${#suites[@]} -gt 0 ] || fail_usage "no suite named"
cd "$(dirname "$0")/.."
. scripts/prepare.sh
. scripts/minimal_system.sh

for suite in "${suites[@]}"; do
    began=$SECONDS
    make_system "$suite" "$keep"
    mkdir "$system/srv/clerestory"
    git archive HEAD | tar -C "$system/srv/clerestory" -x
    in_system "$system" env -C /srv/clerestory "DEBFULLNAME=${DEBFULLNAME:-}" "DEBEMAIL=${DEBEMAIL:-}" bash -euc '
        . scripts/prepare.sh
        install_missing $(packages_for run) dpkg-dev lintian
        if [ -z "$DEBFULLNAME" ] || [ -z "$DEBEMAIL" ]; then unset DEBFULLNAME DEBEMAIL; fi
        configure package
        build package
        (cd build/package && cpack >/dev/null)
        lintian --fail-on error --suppress-tags-from-file cmake/debian/lintian-ignored build/package/*.deb
    '
    made=$builds/package/$suite
    rm -rf "$made"
    mkdir -p "$made"
    cp "$system"/srv/clerestory/build/package/*.deb "$made/"
    remove_systems
    echo "$suite: built after $((SECONDS - began)) s:"
    ls -l "$made"

    make_system "$suite" "$keep"
    mkdir "$system/packages"
    cp "$made"/*.deb scripts/use_package.sh "$system/packages/"
    in_system "$system" env TERM=dumb LANG=C.UTF-8 /packages/use_package.sh
    remove_systems
    echo "$suite: all passed after $((SECONDS - began)) s"
done
