"""Several servers behind HAProxy with docker/fleet/haproxy.cfg; the sidecar for Agones."""

import contextlib
import http.server
import importlib.util
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import drape
from conftest import ROOT, sheet
from drape.private_server import PrivateServer
from stream_ends import all_ends_are_told

SERVERS = ("a", "b")
PATIENCE_S = 30


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


class Fleet:
    """HAProxy before a server of each name."""

    def __init__(self, folder):
        self.socket = folder / "socket"
        self.monitoring = {name: free_port() for name in SERVERS}
        self.servers = {name: self.start(name) for name in SERVERS}
        port = free_port()
        self.address = f"127.0.0.1:{port}"
        text = (ROOT / "docker/fleet/haproxy.cfg").read_text()
        changes = {"/tmp/drape-fleet.sock": str(self.socket), "bind 127.0.0.1:7743": f"bind {self.address}"}
        for name, server in self.servers.items():
            changes[f"draped-{name}:7743 port 7744"] = f"{server.address} port {self.monitoring[name]}"
        for old, new in changes.items():
            assert old in text
            text = text.replace(old, new)
        (folder / "haproxy.cfg").write_text(text)
        program = shutil.which("haproxy") or "/usr/sbin/haproxy"
        self.log = (folder / "log").open("wb")
        self.proxy = subprocess.Popen([program, "-db", "-f", folder / "haproxy.cfg"], stdout=self.log, stderr=self.log)
        for name in SERVERS:
            self.wait_for(name, "UP")

    def start(self, name):
        return PrivateServer("cpu", flags=[f"--server-id={name}", f"--metrics-listen=127.0.0.1:{self.monitoring[name]}"])

    def tell(self, command):
        """The answer of HAProxy's runtime API."""
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(str(self.socket))
            connection.sendall(command.encode() + b"\n")
            return b"".join(iter(lambda: connection.recv(4096), b"")).decode()

    def state(self, name):
        lines = [line.split(",") for line in self.tell("show stat").splitlines()]
        return next((line[17] for line in lines if line[:2] == ["sessions", name]), "")

    def wait_for(self, name, state):
        end = time.monotonic() + PATIENCE_S
        while True:
            with contextlib.suppress(OSError):  # the proxy starts
                if self.state(name).startswith(state):
                    return
            assert time.monotonic() < end, f"server {name} is not {state}"
            time.sleep(0.02)

    def stop(self):
        self.proxy.terminate()
        self.proxy.wait(PATIENCE_S)
        self.log.close()
        for server in self.servers.values():
            server.stop()


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    fleet = Fleet(tmp_path_factory.mktemp("fleet"))
    yield fleet
    fleet.stop()


class Names:
    """A DNS of one address for every name (RFC 1035): a reply has the question, and one record of type A."""

    def __init__(self, address):
        self.address = address
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self.place = "{}:{}".format(*self._socket.getsockname())
        threading.Thread(target=self._answer, daemon=True).start()

    def _answer(self):
        while True:
            query, sender = self._socket.recvfrom(4096)
            end = query.index(b"\0", 12) + 5  # of the question: its name, type and class
            is_a = query[end - 4:end - 2] == b"\0\1"
            record = b"\xc0\x0c\0\1\0\1\0\0\0\1\0\4" + socket.inet_aton(self.address)  # for 1 s
            head = query[:2] + b"\x81\x80\0\1" + (b"\0\1" if is_a else b"\0\0") + b"\0\0\0\0"
            self._socket.sendto(head + query[12:end] + (record if is_a else b""), sender)


@pytest.mark.full  # needs HAProxy
def test_a_server_may_get_another_address(tmp_path):
    names = Names("127.0.0.2")
    text = (ROOT / "docker/fleet/haproxy.cfg").read_text()
    changes = {"/tmp/drape-fleet.sock": str(tmp_path / "socket"), "bind 127.0.0.1:7743": f"bind 127.0.0.1:{free_port()}",
               "parse-resolv-conf": f"nameserver test {names.place}"}
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "haproxy.cfg").write_text(text)

    def addresses():
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(str(tmp_path / "socket"))
            connection.sendall(b"show servers state sessions\n")
            lines = b"".join(iter(lambda: connection.recv(4096), b"")).decode().splitlines()
        return {line.split()[4] for line in lines if "sessions" in line}

    def wait_for(address):
        end = time.monotonic() + PATIENCE_S
        while True:
            with contextlib.suppress(OSError):  # the proxy starts
                if addresses() == {address}:
                    return
            assert time.monotonic() < end, f"not {address}: {addresses()}"
            time.sleep(0.1)

    program = shutil.which("haproxy") or "/usr/sbin/haproxy"
    with subprocess.Popen([program, "-db", "-f", tmp_path / "haproxy.cfg"], stderr=subprocess.DEVNULL) as proxy:
        try:
            wait_for("127.0.0.2")
            names.address = "127.0.0.3"
            wait_for("127.0.0.3")
        finally:
            proxy.terminate()


def where(session):
    return session.name.removeprefix("sessions/").split("-")[0]


def sessions_on_all(fleet):
    """One on each server by its name, each by a client of its own, as other processes would. HAProxy chooses at random."""
    found = {}
    for _ in range(64):
        session = drape.connect(fleet.address).session()
        found[where(session)] = session
        if len(found) == len(SERVERS):
            return found
    raise AssertionError(f"all sessions are on {list(found)}")


@pytest.mark.full
def test_sessions_spread_and_stay_where_they_are(fleet):
    batches = [session.create(sheet()) for session in sessions_on_all(fleet).values()]
    for _ in range(5):
        for batch in batches:
            batch.step()
    with drape.launch("cpu") as client:
        alone = client.session().create(sheet())
        alone.step(5)
        for batch in batches:
            assert batch.read().step_count.tolist() == [5]
            assert np.array_equal(batch.positions, alone.positions)
    with pytest.raises(drape.NotFound) as caught:
        drape.connect(fleet.address).session(name="sessions/z-" + 32 * "0")
    assert caught.value.reason == "WRONG_SERVER"


@pytest.mark.full
def test_streams_end_as_with_one_server(fleet):
    all_ends_are_told(fleet.address)


@pytest.mark.full
def test_a_draining_server_keeps_its_sessions_and_gets_no_new_ones(fleet):
    batches = [session.create(sheet()) for session in sessions_on_all(fleet).values()]
    fleet.tell("set server sessions/a state drain")
    fleet.wait_for("a", "DRAIN")
    assert {where(drape.connect(fleet.address).session()) for _ in range(12)} == {"b"}
    for batch in batches:
        batch.step()
    fleet.tell("set server sessions/a state ready")
    fleet.wait_for("a", "UP")
    sessions_on_all(fleet)


@pytest.mark.full
def test_the_script_for_compose_drains_too(fleet, tmp_path, monkeypatch):
    """An imitation of `docker compose exec` runs what it is told here, where the socket is elsewhere."""
    (tmp_path / "docker").write_text(f"""#!{sys.executable}
import os, sys
assert sys.argv[1:7] == ["compose", "-f", "{ROOT}/docker/fleet/compose.yaml", "exec", "-T", "proxy"], sys.argv
command = [word.replace("/tmp/drape-fleet.sock", "{fleet.socket}") for word in sys.argv[7:]]
os.execvp(command[0], command)
""")
    (tmp_path / "docker").chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    tell = lambda *words: subprocess.run([ROOT / "docker/fleet/tell.sh", *words], capture_output=True, text=True, timeout=30)
    assert tell("set server sessions/a state drain").returncode == 0
    fleet.wait_for("a", "DRAIN")
    assert "sessions,a," in tell("show stat").stdout
    assert tell("set server sessions/a state ready").returncode == 0
    fleet.wait_for("a", "UP")
    assert tell().returncode != 0


@pytest.mark.full
def test_the_sessions_of_a_dead_server_are_unavailable_and_others_go_on(fleet):
    batches = {name: session.create(sheet()) for name, session in sessions_on_all(fleet).items()}
    os.kill(fleet.servers["a"].pid, signal.SIGKILL)
    fleet.wait_for("a", "DOWN")
    # Not NotFound: the server may come back with its sessions.
    with pytest.raises(drape.Unavailable):
        batches["a"].step()
    batches["b"].step()
    assert {where(drape.connect(fleet.address).session()) for _ in range(4)} == {"b"}


class Agones(http.server.BaseHTTPRequestHandler):
    """An imitation of the SDK's port: notes what it is told."""

    def note(self):
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.server.told.append((self.command, self.path, body))
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"{}")

    do_POST = do_PATCH = note

    def log_message(self, *_):
        pass


def test_the_sidecar_tells_agones_about_its_server():
    spec = importlib.util.spec_from_file_location("agones_sidecar", ROOT / "docker/fleet/agones_sidecar.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    agones = http.server.HTTPServer(("127.0.0.1", 0), Agones)
    agones.told = []
    threading.Thread(target=agones.serve_forever, daemon=True).start()
    port = free_port()
    sidecar = module.Sidecar(f"http://127.0.0.1:{port}", f"http://127.0.0.1:{agones.server_port}")
    sidecar.look()
    assert agones.told == [], "there is no server yet"
    server = PrivateServer("cpu", flags=[f"--metrics-listen=127.0.0.1:{port}"])
    alive, ready = ("POST", "/health", {}), ("POST", "/ready", {})
    counted = lambda count: ("PATCH", "/v1beta1/counters/sessions", {"count": str(count)})
    with drape.connect(server.address) as client:
        sidecar.look()
        session = client.session()
        sidecar.look()
        sidecar.look()
        session.close()
        sidecar.look()
    server.stop()
    sidecar.look()
    agones.shutdown()
    assert agones.told == [alive, ready, counted(0), alive, counted(1), alive, alive, counted(0)]
