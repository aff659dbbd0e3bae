#!/usr/bin/env bash
# SOURCE BUILD WORK CMAKE: installs BUILD into WORK/prefix, builds outside/ against it alone, and runs the program with the
# installed server.
set -euo pipefail
source=$1 build=$2 work=$3 cmake=$4
rm -rf "$work"
"$cmake" --install "$build" --prefix "$work/prefix" >/dev/null
"$cmake" -G Ninja -S "$source/tests/install/outside" -B "$work/build" -DCMAKE_BUILD_TYPE=Debug \
  -DCMAKE_PREFIX_PATH="$work/prefix" -DHELLO_CLIENT="$source/client/examples/hello_client.cpp" >/dev/null
"$cmake" --build "$work/build"
if grep -rl "$source" "$work/prefix/lib/cmake" "$work/prefix/include"; then
  echo "the installed files above name the source tree" >&2
  exit 1
fi
env -u DRAPE_SERVER PATH="$work/prefix/bin:/usr/bin:/bin" "$work/build/hello_client" | tee "$work/output"
grep -q "^1.0 s: the free corner is at" "$work/output"
"$work/prefix/bin/drape" run "$work/prefix/share/drape/examples/chain.json" --backend=reference >/dev/null
