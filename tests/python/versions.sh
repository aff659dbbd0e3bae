#!/usr/bin/env bash
# SOURCE WORK: the tests of the package with the oldest and the newest libraries that it says it works with, installed from
# its wheel (`./run wheels`), gymnasium's and the examples' among them; and what touches the wire with old grpcio beside new
# protobuf, and the other way round. Expects DRAPE_SERVER and DRAPE_CLI.
set -euo pipefail
source=$1 work=$2
wheel=$(ls "$source"/build/wheels/drape_sim-*.whl) || { echo "./run wheels comes first" >&2; exit 1; }
# The lower bounds of pyproject.toml.
old_grpcio=(grpcio==1.60.2)
old_protobuf=(protobuf==4.25.8 googleapis-common-protos==1.62.0)
old_others=(numpy==1.26.4 gymnasium==1.1.0 viser==1.0.28 trimesh==4.0.0 tqdm==4.60.0)
# By which test_install builds the package.
old_build=(hatchling==1.21.0 grpcio-tools==1.60.2)
wire=()
for test in v1 client errors retries connection columns views; do wire+=("$source/tests/python/test_$test.py"); done
# The newest are in build/venv, by which ./run test --full does these.
proxied=("$source/tests/python/test_exposed.py" "$source/tests/python/test_fleet.py" -m full -k streams_end)
rm -rf "$work"

# tests NAME TESTS... -- PACKAGES...: in an environment of its own; packages that are not named are the newest.
tests() {
  local name=$1 chosen=(); shift
  while [ "$1" != -- ]; do chosen+=("$1"); shift; done
  shift
  /usr/bin/python3 -m venv "$work/$name"
  "$work/$name/bin/pip" --disable-pip-version-check install --quiet "$wheel[gym,viewer,mesh,progress]" pytest pillow "$@"
  echo "== $name"
  "$work/$name/bin/pip" --disable-pip-version-check list 2>/dev/null | grep -E "^(protobuf|grpcio|numpy|gymnasium|viser) "
  (cd "$work" && "$work/$name/bin/python" -B -m pytest -q "${chosen[@]}")
}

tests oldest "$source/tests/python" -- "${old_grpcio[@]}" "${old_protobuf[@]}" "${old_others[@]}" "${old_build[@]}"
tests oldest_proxied "${proxied[@]}" -- "${old_grpcio[@]}" "${old_protobuf[@]}" "${old_others[@]}"
tests newest "$source/tests/python" -- hatchling grpcio-tools
tests old_grpcio "${wire[@]}" -- "${old_grpcio[@]}"
tests old_protobuf "${wire[@]}" -- "${old_protobuf[@]}"
