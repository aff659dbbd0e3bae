"""What HAProxy costs per call: an empty Step, and one with positions, of a session through docker/fleet/haproxy.cfg and of the
same session at its server, call by call in turn."""

import pathlib
import shutil
import socket
import subprocess
import tempfile
import time

import numpy as np
from medians import of_median

import drape
from drape import ClothSpec, Grid, StepSettings
from drape.private_server import PrivateServer

CONFIGURATION = pathlib.Path(__file__).resolve().parents[3] / "docker/fleet/haproxy.cfg"
SIDE = 32
CASES = [("empty Step", 1, None), ("64 x 1024, positions", 64, drape.POSITIONS)]
CALLS, WARM_UP = 2000, 50
PATIENCE_S = 30


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def configuration(server, monitoring, folder, port):
    """The fleet's, of one server on this machine."""
    lines = CONFIGURATION.read_text().replace("/tmp/drape-fleet.sock", f"{folder}/socket").splitlines()
    lines = [line for line in lines if not line.lstrip().startswith("server ")]
    text = "\n".join([*lines, f"  server a {server.address} port {monitoring}", ""])
    return text.replace("bind 127.0.0.1:7743", f"bind 127.0.0.1:{port}")


def connected(address):
    end = time.monotonic() + PATIENCE_S
    while True:
        try:
            return drape.connect(address)
        except drape.Unavailable:
            if time.monotonic() > end:
                raise
            time.sleep(0.1)


def in_turn(batches, view, calls):
    """Wall of each call, [2, calls]."""
    times = np.zeros((2, calls))
    for number in range(calls + WARM_UP):
        for which in (0, 1) if number % 2 else (1, 0):
            begin = time.perf_counter()
            batches[which].step(view=view)
            times[which, number - WARM_UP] = time.perf_counter() - begin
    return times


def measure(is_quick):
    """A row per case: medians, and the median of what the proxy adds to a call, with its bounds."""
    program = shutil.which("haproxy") or "/usr/sbin/haproxy"
    monitoring, port = free_port(), free_port()
    server = PrivateServer("cpu", flags=["--server-id=a", f"--metrics-listen=127.0.0.1:{monitoring}"])
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "haproxy.cfg")
        path.write_text(configuration(server, monitoring, folder, port))
        proxy = subprocess.Popen([program, "-db", "-f", path], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            return [row_of(server.address, f"127.0.0.1:{port}", *case, 200 if is_quick else CALLS) for case in CASES]
        finally:
            proxy.terminate()
            proxy.wait(PATIENCE_S)
            server.stop()


def row_of(at_server, at_proxy, name, cloths, view, calls):
    # As in client.py: one cheap sweep, so that the way counts.
    sheet = ClothSpec(grid=Grid(columns=SIDE, rows=SIDE, width_m=1, height_m=1), settings=StepSettings(substeps=1, max_iterations=1))
    with connected(at_proxy) as through, drape.connect(at_server) as direct, through.session() as session:
        batches = [direct.session(name=session.name), session]
        session.create(sheet, cloths)
        times = 1e3 * in_turn([own.attach() for own in batches], view, calls)
    added, low, high = of_median(times[1] - times[0])
    return {"case": name, "calls": calls, "direct_ms": float(np.median(times[0])), "proxy_ms": float(np.median(times[1])),
            "added_ms": added, "added_95_low_ms": low, "added_95_high_ms": high}
