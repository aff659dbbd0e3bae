#!/usr/bin/env bash
# SOURCE BUILD WORK CMAKE: `cpack -G DEB` makes two packages with the right contents and dependencies.
set -euo pipefail
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
