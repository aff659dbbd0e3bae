# Sourced: roots of a fresh Debian 12 without anything else of this machine. Needs mmdebstrap, Debian's archive and root.
[ "$(id -u)" -eq 0 ] || exec sudo --preserve-env "$0" "$@"

# make_root FOLDER PACKAGES...: a minimal system, and these.
make_root() {
  local root=$1 packages; shift
  packages=$(IFS=,; echo "$*")
  mmdebstrap --quiet --variant=minbase --include="$packages" bookworm "$root" http://deb.debian.org/debian >"$root.log" 2>&1 ||
    { tail -n 20 "$root.log" >&2; echo "mmdebstrap failed" >&2; return 1; }
}

# within FOLDER COMMAND...: in that root, with no network but its own loopback, no devices, no process of others, and a plain
# environment. What it starts ends with it.
within() {
  local root=$1; shift
  unshare --mount --pid --net --fork --kill-child bash -c '
    set -euo pipefail
    root=$1; shift
    mount -t proc proc "$root/proc"
    ip link set lo up
    exec env -i HOME=/root PATH=/usr/bin:/bin:/usr/sbin:/sbin LC_ALL=C.UTF-8 chroot "$root" "$@"' bash "$root" "$@"
}
