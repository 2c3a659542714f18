# Minimal Debian systems that are thrown away, for what must work where nothing is installed. Sourced from the repository's root after
# scripts/prepare.sh. Needs root. Whoever sets a trap on EXIT of its own calls remove_systems in it.
#   make_system SUITE [KEPT]       makes one (bookworm, trixie, ...) and names its folder in $system. In the folder KEPT, where one is
#                                  given, stay what debootstrap made and the packages that were downloaded, for the next run.
#   in_system FOLDER COMMAND ...   runs a command in it, with nothing but an empty HOME and a PATH in its environment
#   remove_systems                 ends what runs in them and deletes them; happens by itself when the script ends
minimal_systems=()
minimal_process=

make_system() {
    local suite=$1 kept=${2:-}
    if [ "$(id -u)" -ne 0 ]; then
        echo "a minimal system can be made by root only" >&2
        exit 2
    fi
    command -v debootstrap >/dev/null || install_missing debootstrap
    system=$(mktemp -d)
    minimal_systems+=("$system")
    chmod 755 "$system"
    if [ -n "$kept" ] && [ -e "$kept/$suite.tar" ]; then
        tar -C "$system" --numeric-owner -xf "$kept/$suite.tar"
    else
        if ! isolated debootstrap --variant=minbase "$suite" "$system" >"$system/debootstrap.out" 2>&1; then
            tail -n 20 "$system/debootstrap.out" >&2
            return 1
        fi
        rm -f "$system/debootstrap.out" "$system"/var/cache/apt/archives/*.deb
        if [ -n "$kept" ]; then
            mkdir -p "$kept"
            tar -C "$system" --numeric-owner --one-file-system -cf "$kept/$suite.tar.$$" .
            mv "$kept/$suite.tar.$$" "$kept/$suite.tar"
        fi
    fi
    cp -L /etc/resolv.conf /etc/hosts "$system/etc/"
    if [ -n "${http_proxy:-}" ]; then echo "Acquire::http::Proxy \"$http_proxy\";" >"$system/etc/apt/apt.conf.d/99proxy"; fi
    mkdir "$system/home/empty"
    if [ -n "$kept" ]; then
        mkdir -p "$kept/$suite-packages"
        realpath "$kept/$suite-packages" >"$system.packages"
    fi
}

# Mounts and processes live in namespaces of their own, which end with the command: nothing is left mounted, however the script ends, and
# deleting a system never meets another file system.
isolated() {
    local status=0
    # In the background, so that signals are heard while it runs.
    setpriv --pdeathsig KILL unshare --mount --mount-proc --pid --fork --kill-child=KILL "$@" </dev/null &
    minimal_process=$!
    wait "$minimal_process" || status=$?
    minimal_process=
    return "$status"
}

in_system() {
    local root=$1 packages=
    shift
    if [ -e "$root.packages" ]; then packages=$(cat "$root.packages"); fi
    isolated sh -euc '
        root=$1 packages=$2
        shift 2
        umask 022
        mount -t proc proc "$root/proc"
        mount -t sysfs -o ro sysfs "$root/sys"  # PoCL asks it for processors and memory
        mount -t tmpfs -o mode=755 dev "$root/dev"
        for device in null zero full random urandom tty; do
            : >"$root/dev/$device"
            mount --bind "/dev/$device" "$root/dev/$device"
        done
        mkdir "$root/dev/pts" "$root/dev/shm"
        mount -t devpts -o newinstance,ptmxmode=666,mode=620,gid=5 devpts "$root/dev/pts"
        mount -t tmpfs -o mode=1777 shm "$root/dev/shm"
        ln -s pts/ptmx "$root/dev/ptmx"
        ln -s /proc/self/fd "$root/dev/fd"
        ln -s /proc/self/fd/0 "$root/dev/stdin"
        ln -s /proc/self/fd/1 "$root/dev/stdout"
        ln -s /proc/self/fd/2 "$root/dev/stderr"
        if [ -n "$packages" ]; then mount --bind "$packages" "$root/var/cache/apt/archives"; fi
        chroot "$root" /usr/bin/env -i HOME=/home/empty PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "$@"
    ' minimal "$root" "$packages" "$@"
}

remove_systems() {
    if [ -n "$minimal_process" ]; then
        kill -KILL "$minimal_process" 2>/dev/null || true
        { wait "$minimal_process" || true; } 2>/dev/null
        minimal_process=
    fi
    local root
    for root in "${minimal_systems[@]}"; do
        # Twice: what was killed may have written once more.
        rm -rf --one-file-system "$root" "$root.packages" 2>/dev/null || rm -rf --one-file-system "$root"
    done
    minimal_systems=()
}
trap remove_systems EXIT
trap 'exit 129' HUP
trap 'exit 130' INT
trap 'exit 143' TERM
