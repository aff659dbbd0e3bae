#!/usr/bin/env bash
# SOURCE BUILD WORK CMAKE: `cpack -G DEB` makes two packages with the right contents and dependencies; the programs of the one
# run in a fresh Debian 12 that has what it depends on, and nothing else.
set -euo pipefail
source "$(dirname "$0")/root.sh"
source=$1 build=$2 work=$3 cmake=$4
rm -rf "$work"
mkdir -p "$work"
(cd "$build" && "$(dirname "$cmake")/cpack" -G DEB -B "$work" >"$work/log") || { cat "$work/log" >&2; exit 1; }
runtime=("$work"/drape_*.deb) development=("$work"/libdrape-dev_*.deb)
dpkg-deb --contents "${runtime[0]}" | awk '{print $6}' >"$work/runtime"
dpkg-deb --contents "${development[0]}" | awk '{print $6}' >"$work/development"
grep -qx ./usr/bin/draped "$work/runtime"
grep -qx ./usr/bin/drape "$work/runtime"
grep -qx ./usr/share/drape/examples/skirt.json "$work/runtime"
if grep -E "\.(h|a|cmake)$" "$work/runtime"; then exit 1; fi
grep -qx ./usr/include/drape/client.h "$work/development"
grep -q "/cmake/Drape/DrapeConfig.cmake$" "$work/development"
dpkg-deb --field "${runtime[0]}" Depends | grep -q libgrpc
dpkg-deb --field "${development[0]}" Depends | grep -q libgrpc++-dev

mapfile -t depends < <(dpkg-deb --field "${runtime[0]}" Depends | tr , '\n' | awk '{print $1}')
make_root "$work/root" "${depends[@]}"
cp "${runtime[0]}" "$work/root/drape.deb"
within "$work/root" bash -euo pipefail -c '
  dpkg --install /drape.deb >/dev/null
  cd /tmp
  drape run /usr/share/drape/examples/chain.json --backend=cpu >/dev/null   # a server of its own
  draped --listen=127.0.0.1:7743 --backend=cpu --log-level=warn &
  server=$!
  for _ in $(seq 100); do drape info --server=127.0.0.1:7743 >info 2>/dev/null && break; sleep 0.1; done
  cat info
  drape run /usr/share/drape/examples/chain.json --server=127.0.0.1:7743 --states=/tmp/states.npz >/dev/null
  test -s states.npz
  kill -TERM $server
  wait $server
  dpkg --purge drape >/dev/null
  if [ -e /usr/bin/draped ] || [ -e /usr/share/drape ]; then echo "the package leaves files behind" >&2; exit 1; fi' |
  tee "$work/output"
grep -q cpu "$work/output"
rm -rf "$work/root"
