#!/usr/bin/env bash
# SOURCE WORK: installs the wheels of `./run wheels` into a virtual environment of its own, and uses them there without
# anything of the checkout. The libraries of the server come from the wheel, but for glibc's.
set -euo pipefail
source=$1 work=$2
ls "$source"/build/wheels/drape_server-*-manylinux_*.whl >/dev/null || { echo "./run wheels comes first" >&2; exit 1; }
ls "$source"/build/wheels/drape_server-*-manylinux_2_35_x86_64.whl || { echo "client/python/server/README.md names another glibc" >&2; exit 1; }
# What is to be fetched: the programs and 50 libraries, OpenSSL's and gRPC's half of it.
most_bytes=14000000
bytes=$(stat -c %s "$source"/build/wheels/drape_server-*-manylinux_*.whl)
echo "drape-server: $bytes bytes"
[ "$bytes" -le $most_bytes ] || { echo "the wheel is larger than $most_bytes bytes" >&2; exit 1; }
rm -rf "$work"
/usr/bin/python3 -m venv "$work/venv"
"$work/venv/bin/pip" --disable-pip-version-check install --quiet --find-links "$source/build/wheels" 'drape-sim[server]'
cp "$source/client/python/examples/hello.py" "$work"
cd "$work"
env -i HOME="$work" PATH=/nowhere "$work/venv/bin/python" hello.py | tee output
grep -q "1.0 s: the free corner is at" output
server=$(env -i HOME="$work" PATH=/nowhere "$work/venv/bin/python" -c 'import drape; print(drape.find_server())')
case $server in "$work"/venv/*) ;; *) echo "the server is $server" >&2; exit 1 ;; esac
if ldd "$server" | grep -vE "$work/venv/|linux-vdso|ld-linux|/lib(c|m|pthread|dl|rt|stdc\+\+|gcc_s)\.so|/lib(z|expat)\.so"; then
  echo "the server uses the libraries above, which are not in the wheel" >&2
  exit 1
fi
