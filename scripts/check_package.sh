#!/usr/bin/env bash
# Builds the Debian packages, installs them with apt in a fresh Debian 12 (a chroot that is thrown away), and uses them there as somebody
# would who has nothing else: scripts/use_package.sh. Root, and some minutes of downloads.
# An argument names a tree that debootstrap has made before; a copy of it is used.
set -euo pipefail
cd "$(dirname "$0")/.."
. scripts/prepare.sh
install_packages debootstrap lintian dpkg-dev
configure package
build package
rm -f build/package/*.deb
(cd build/package && cpack >/dev/null)
ls -l build/package/*.deb
lintian --fail-on error --suppress-tags-from-file cmake/debian/lintian-ignored build/package/*.deb

root=$(mktemp -d)
clean_up() {
    for place in dev/pts dev sys proc; do
        if mountpoint -q "$root/$place"; then umount "$root/$place"; fi
    done
    rm -rf --one-file-system "$root"
}
trap clean_up EXIT
if [ $# -gt 0 ]; then
    cp -a "$1/." "$root"
else
    debootstrap --variant=minbase bookworm "$root" >/dev/null
fi
cp /etc/resolv.conf /etc/hosts "$root/etc/"
mount -t proc proc "$root/proc"
mount -t sysfs sysfs "$root/sys"  # PoCL asks it for processors and memory
mount --bind /dev "$root/dev"
mount --bind /dev/pts "$root/dev/pts"
mkdir "$root/packages"
cp build/package/*.deb scripts/use_package.sh "$root/packages/"
chroot "$root" env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin TERM=dumb LANG=C.UTF-8 /packages/use_package.sh
