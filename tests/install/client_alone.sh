#!/usr/bin/env bash
# SOURCE BUILD WORK CMAKE: -DDRAPE_SERVER=OFF builds and installs the client library with gRPC and protobuf alone: no other
# package may be looked for.
set -euo pipefail
source=$1 build=$2 work=$3 cmake=$4
rm -rf "$work"
disabled=()
for package in Eigen3 spdlog TBB hwy CLI11 nlohmann_json tinyobjloader PNG GTest; do
  disabled+=("-DCMAKE_DISABLE_FIND_PACKAGE_$package=ON")
done
"$cmake" --preset release -S "$source" -B "$work/build" -DDRAPE_SERVER=OFF "${disabled[@]}" >/dev/null
"$cmake" --build "$work/build"
"$cmake" --install "$work/build" --prefix "$work/prefix" >/dev/null
test -e "$work/prefix/include/drape/client.h"
test ! -e "$work/prefix/include/drape/scene_file.h"
test ! -e "$work/prefix/bin"
c++ -std=c++20 -fsyntax-only -I "$work/prefix/include" "$source/client/examples/hello_client.cpp"
