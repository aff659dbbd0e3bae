#!/usr/bin/env bash
# SOURCE BUILD WORK CMAKE: a fresh Debian 12 with Python alone, as python:3.11-slim is: the wheels of `./run wheels` and what
# they need of PyPI are installed there, and then a new user's first hour: hello, the random policy, an environment, the
# notebook's cells, the viewer, shards on two nodes of Ray. No compiler, no EGL, no network but the loopback.
set -euo pipefail
source "$(dirname "$0")/root.sh"
source=$1 work=$3
ls "$source"/build/wheels/drape_server-*-manylinux_*.whl >/dev/null || { echo "./run wheels comes first" >&2; exit 1; }
rm -rf "$work"
mkdir -p "$work"
make_root "$work/root" python3 python3-venv
mkdir "$work/root/wheels"
# Ray in the version of the other tests.
sed -n 's/^\(ray==[^ ]*\).*/\1/p' "$source/client/python/ray.lock" >"$work/ray"
# Fetched here, where certificates and proxies are those of the machine; the Python is of the same version.
/usr/bin/python3 -m venv "$work/fetching"
"$work/fetching/bin/pip" --disable-pip-version-check download --quiet --only-binary=:all: --dest "$work/root/wheels" \
  --find-links "$source/build/wheels" --constraint "$work/ray" 'drape-sim[server,gym,viewer,ray]'
cp -r "$source/client/python/examples" "$source/tests/install/first_hour" "$work/root/root/"
cp "$source/client/examples/hanging_two_corners.json" "$work/root/root/examples/"
within "$work/root" bash -euo pipefail -c '
  if type cc gcc c++ 2>/dev/null; then echo "the root is not bare" >&2; exit 1; fi
  python3 -m venv /root/venv
  /root/venv/bin/pip --disable-pip-version-check install --quiet --no-index --find-links /wheels "drape-sim[server,gym,viewer,ray]"
  cd /tmp
  /root/venv/bin/python /root/examples/hello.py
  /root/venv/bin/python /root/examples/random_policy.py 2 1
  for part in environment notebook viewer two_nodes; do /root/venv/bin/python "/root/first_hour/$part.py"; done' | tee "$work/output"
for said in "1.0 s: the free corner is at" "by hand: normalized performance 0.9" "environment: 4 episodes" \
  "notebook: INVALID_FIELDS" "viewer: a page of" "two nodes: 4 environments"; do
  grep -q "$said" "$work/output" || { echo "missing: $said" >&2; exit 1; }
done
rm -rf "$work/root"
