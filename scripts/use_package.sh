#!/usr/bin/env bash
# What a stranger does with the packages that lie beside this script, on a system that is not theirs to keep: check_package.sh runs it.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
export DEBIAN_FRONTEND=noninteractive
say() { echo "== $*"; }
# press KEYS: types them at an interactive bash that has read the system's completions; what it prints is not kept.
press() {
    printf '. /usr/share/bash-completion/bash_completion\r%b\rexit\r' "$1" | script -qec 'bash --norc -i' /dev/null >/dev/null
}

say "apt installs the program"
apt-get update -qq
apt-get install -y -qq --no-install-recommends "$here"/clerestory_*.deb man-db bash-completion >/dev/null
clerestory --version

say "clerestory render, in an empty folder, with no map"
cd "$(mktemp -d)"
clerestory render -o sphere.png
test -s sphere.png
say "clerestory fresnel draws a plot"
clerestory fresnel -q -o fresnel.svg
test -s fresnel.svg
say "a format that the module reads"
clerestory render -q --size 9 -n 8 -o map.png
clerestory info map.png | grep -q '9 x 9'

say "sixteen descriptors are enough"
(ulimit -n 16 && clerestory render -q --size 9 -n 8 map.png -o few.png)
test -s few.png

say "nobody else's code: in the current folder, in a shared cache, in a temporary folder"
chmod 755 .
install -d -o nobody evil evil/clerestory evil/clerestory/programs
echo "no module" | tee evil/clerestory_oiio.so >evil/clerestory/clerestory_oiio.so
(cd evil && clerestory info ../map.png | grep -q '9 x 9')
install -d -m 1777 /var/tmp/shared
for place in clerestory-0 pocl clerestory; do install -d -m 777 -o nobody "/var/tmp/shared/$place"; done
env -u HOME CLERESTORY_CACHE_DIR=/var/tmp/shared POCL_CACHE_DIR=/var/tmp/shared TMPDIR=/var/tmp/shared \
    clerestory render -q --size 9 -n 8 --estimator per-pixel map.png -o cached.png
test -z "$(find /var/tmp/shared/clerestory-0 /var/tmp/shared/pocl /var/tmp/shared/clerestory -mindepth 1)"
test -z "$(find /var/tmp/shared -mindepth 1 -user root -perm /077)"
rm -r /var/tmp/shared

say "man clerestory-render"
MANWIDTH=100 man --warnings=w clerestory-render >page 2>warnings
test ! -s warnings
grep -q -- '--control-degree' page
man -w clerestory >/dev/null

say "bash completes a command and a flag, then a command, a flag and a value"
press 'clerestory dev\t--js\tdevices.json'
grep -q '"devices"' devices.json
press 'clerestory rend\t--esti\tex\t--si\t9 -o exact.exr'
test -s exact.exr

say "the example builds against clerestory-dev"
apt-get install -y -qq --no-install-recommends "$here"/clerestory-dev_*.deb cmake g++ make >/dev/null
cmake -S /usr/share/doc/clerestory-dev/examples -B build >/dev/null
cmake --build build >/dev/null
build/sphere example.exr
test -s example.exr

say "apt removes all of it"
apt-get purge -y -qq clerestory clerestory-dev >/dev/null
test ! -e /usr/bin/clerestory
test ! -e /usr/share/clerestory
say "done"
