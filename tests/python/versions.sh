#!/usr/bin/env bash
# SOURCE WORK: the tests of the package with the oldest and the newest libraries that it says it works with, installed from
# its wheel (`./run wheels`). Expects DRAPE_SERVER and DRAPE_CLI.
set -euo pipefail
source=$1 work=$2
wheel=$(ls "$source"/build/wheels/drape_sim-*.whl) || { echo "./run wheels comes first" >&2; exit 1; }
oldest=(protobuf==4.25.8 grpcio==1.85.3 googleapis-common-protos==1.62.0 numpy==1.26.4)
newest=(protobuf grpcio googleapis-common-protos numpy)
rm -rf "$work"
for versions in oldest newest; do
  /usr/bin/python3 -m venv "$work/$versions"
  declare -n packages=$versions
  "$work/$versions/bin/pip" --disable-pip-version-check install --quiet "${packages[@]}" "$wheel[gym,viewer]" pytest pillow tqdm
  "$work/$versions/bin/pip" --disable-pip-version-check list | grep -E "^(protobuf|grpcio|numpy) "
  (cd "$work" && "$work/$versions/bin/python" -B -m pytest -q "$source/tests/python" --ignore="$source/tests/python/gym" \
    --ignore="$source/tests/python/test_examples.py")
done
