"""One server of each kind for all tests, and small cloths."""

import os
import pathlib
import signal
import socket
import subprocess
import sys
import time

import numpy as np
import pytest

import drape
from drape import ClothSpec, Grid, Pin, StepSettings

# A shell that starts the tests in the background has Ctrl-C ignored by them, and by the programs that they interrupt.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = pathlib.Path(__file__).resolve().parents[2]
# The command line, of the build that ctest tests.
DRAPE = os.environ.get("DRAPE_CLI", ROOT / "build/release/bin/drape")


@pytest.fixture(scope="session")
def client():
    with drape.launch("cpu", flags=["--threads=1"]) as client:
        yield client


@pytest.fixture(scope="session")
def reference():
    with drape.launch("reference") as client:
        yield client


@pytest.fixture
def session(client):
    with client.session(display_name="tests/python") as session:
        yield session


@pytest.fixture
def spec():
    return sheet()


@pytest.fixture
def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def wait_for(condition, within_s=5.0):
    end = time.monotonic() + within_s
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)
    assert condition()


def sheet(side=6, **fields):
    """A square of 1 m, hung by two corners."""
    fields.setdefault("pins", [Pin(particle=0), Pin(particle=side - 1)])
    fields.setdefault("settings", StepSettings(substeps=8))
    return ClothSpec(grid=Grid(columns=side, rows=side, width_m=1, height_m=1), **fields)


def certificate_of(folder, name):
    """New files of a certificate of 127.0.0.1 with this common name, and of its key."""
    certificate, key = folder / "cert.pem", folder / "key.pem"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", f"/CN={name}",
                    "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", key, "-out", certificate], check=True, capture_output=True)
    return certificate, key


class Restarted:
    """A server on one port with checkpoints in `folder`, which can end and start again."""

    def __init__(self, folder):
        self.folder = folder
        self._port = 0
        self.start()

    def start(self):
        port_file = self.folder / "port"
        port_file.unlink(missing_ok=True)
        self._process = subprocess.Popen(
            [drape.find_server(), f"--listen=127.0.0.1:{self._port}", f"--port-file={port_file}", "--backend=cpu", "--threads=1",
             f"--checkpoint-dir={self.folder / 'checkpoints'}", "--log-level=warn"])
        end = time.monotonic() + 60
        while not port_file.exists():
            assert self._process.poll() is None and time.monotonic() < end
            time.sleep(0.01)
        self._port = int(port_file.read_text())
        self.address = f"127.0.0.1:{self._port}"

    def drain(self):
        """Ends it; every session is in a file."""
        self._process.terminate()
        self._process.wait(60)


@pytest.fixture
def restarted(tmp_path):
    server = Restarted(tmp_path)
    yield server
    server.drain()


def bits(array):
    """For comparisons that a NaN or a signed zero cannot cheat."""
    array = np.ascontiguousarray(array)
    return array.dtype, array.shape, array.tobytes()


def run_python(code, *arguments, **options):
    """`code` in a Python of its own; its output. Fails with its errors."""
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, timeout=60, **options)
    assert done.returncode == 0, done.stderr
    return done.stdout
