#!/usr/bin/env bash
# SOURCE BUILD WORK CMAKE: -DDRAPE_SERVER=OFF builds and installs the client library with gRPC and protobuf alone: no other
# package may be looked for.
set -euo pipefail
source=$1 build=$2 work=$3 cmake=$4
rm -rf "$work"
mkdir -p "$work"
disabled=()
for package in Eigen3 spdlog TBB hwy CLI11 nlohmann_json tinyobjloader PNG GTest civetweb prometheus-cpp; do
  disabled+=("-DCMAKE_DISABLE_FIND_PACKAGE_$package=ON")
done
"$cmake" --preset release -S "$source" -B "$work/build" -DDRAPE_SERVER=OFF "${disabled[@]}" \
  --trace-format=json-v1 --trace-redirect="$work/trace" >/dev/null
# OpenSSL and pkg-config cannot be disabled: gRPC's own package looks for them. This project must not.
grep -E '"cmd":"(find_package|pkg_check_modules|pkg_search_module)"' "$work/trace" | grep -F "\"file\":\"$source/" |
  sed -E 's/^\{"args":\["([^"]*)".*"cmd":"([^"]*)".*/\2 \1/' | sort -u >"$work/looked_for"
diff - "$work/looked_for" <<'TEXT' || { echo "packages looked for are not those expected, see above" >&2; exit 1; }
find_package Protobuf
find_package Threads
find_package gRPC
TEXT
"$cmake" --build "$work/build"
"$cmake" --install "$work/build" --prefix "$work/prefix" >/dev/null
test -e "$work/prefix/include/drape/client.h"
test ! -e "$work/prefix/include/drape/scene_file.h"
test ! -e "$work/prefix/bin"
c++ -std=c++20 -fsyntax-only -I "$work/prefix/include" "$source/client/examples/hello_client.cpp"
