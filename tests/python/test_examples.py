import os
import pathlib
import subprocess
import sys

from conftest import DRAPE, ROOT

EXAMPLES = ROOT / "client/python/examples"


def run(name, *arguments):
    done = subprocess.run([sys.executable, EXAMPLES / name, *arguments], capture_output=True, text=True, timeout=120,
                          env={**os.environ})
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_hello_says_what_the_cpp_example_says():
    out = run("hello.py")
    theirs = subprocess.run([pathlib.Path(DRAPE).with_name("hello_client")], capture_output=True, text=True, timeout=60)
    assert "1.0 s: the free corner is at" in out and "480 constraints" in out
    assert theirs.stdout.splitlines()[:10] == out.splitlines()[:10]
