"""A `draped` to be measured, a proxy before it, and `drape load` against it."""

import hashlib
import json
import pathlib
import resource
import shutil
import socket
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
BIN = ROOT / "build/release/bin"
FEW_S = 60


class Draped:
    """A server with `tenants`, each with a token of its own; ends with the block that it is used in. max_memory_gb: it gets
    no more than that."""

    def __init__(self, *flags, tenants=(), backend="cpu", max_memory_gb=None):
        self._folder = tempfile.TemporaryDirectory(prefix="drape-bench-")
        folder = pathlib.Path(self._folder.name)
        port_file = folder / "port"
        tokens = []
        for tenant in tenants:
            self.token_file(tenant).write_text(f"token-of-{tenant}")
            tokens.append(f"{tenant} {hashlib.sha256(f'token-of-{tenant}'.encode()).hexdigest()}\n")
        if tokens:
            (folder / "tenants").write_text("".join(tokens))
            flags = (*flags, f"--token-file={folder / 'tenants'}")
        self.log = folder / "log"
        with self.log.open("wb") as log:
            self._process = subprocess.Popen(
                [BIN / "draped", "--listen=127.0.0.1:0", f"--port-file={port_file}", f"--backend={backend}", "--log-level=warn", *flags],
                stderr=log, stdout=log)
            if max_memory_gb:
                resource.prlimit(self._process.pid, resource.RLIMIT_DATA, (max_memory_gb * 10**9,) * 2)
        end = time.monotonic() + FEW_S
        while not port_file.exists() or not port_file.read_text().strip():
            if self._process.poll() is not None or time.monotonic() > end:
                raise RuntimeError("draped did not start:\n" + self.log.read_text())
            time.sleep(0.01)
        self.port = int(port_file.read_text())
        self.address = f"127.0.0.1:{self.port}"

    def token_file(self, tenant):
        return pathlib.Path(self._folder.name) / f"token-{tenant}"

    @property
    def is_alive(self):
        return self._process.poll() is None

    def resident_mb(self):
        return resident_mb(self._process)

    def processor_s(self):
        """Of all its threads, by the clock that clock_getcpuclockid gives for a process."""
        return time.clock_gettime((~self._process.pid << 3) | 2)

    def __enter__(self):
        return self

    def kill(self):
        """As a crash would."""
        self._process.kill()
        self._process.wait()

    def __exit__(self, *_):
        self._process.terminate()
        try:
            self._process.wait(FEW_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._folder.cleanup()


def resident_mb(process):
    for line in pathlib.Path(f"/proc/{process.pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1000
    raise RuntimeError("no VmRSS")


class Proxy:
    """HAProxy with docker/exposed/haproxy.cfg before `server_address`; ends with the block that it is used in. pem: a file with
    a certificate and its key; without one clients speak plain text."""

    def __init__(self, server_address, pem=None):
        self._folder = tempfile.TemporaryDirectory(prefix="drape-proxy-")
        folder = pathlib.Path(self._folder.name)
        with socket.socket() as listener:
            listener.bind(("127.0.0.1", 0))
            port = listener.getsockname()[1]
        self.address = f"127.0.0.1:{port}"
        text = (ROOT / "docker/exposed/haproxy.cfg").read_text()
        for old, new in {"127.0.0.1:7744": server_address, "bind :7743": f"bind {self.address}",
                         **({"/etc/haproxy/drape.pem": str(pem)} if pem else
                            {"ssl crt /etc/haproxy/drape.pem alpn h2": "proto h2"})}.items():
            if old not in text:
                raise RuntimeError(f"no '{old}' in docker/exposed/haproxy.cfg")
            text = text.replace(old, new)
        (folder / "haproxy.cfg").write_text(text)
        program = shutil.which("haproxy") or "/usr/sbin/haproxy"
        self.log = folder / "log"
        with self.log.open("wb") as log:
            self._process = subprocess.Popen([program, "-db", "-f", folder / "haproxy.cfg"], stdout=log, stderr=log)
        end = time.monotonic() + FEW_S
        while True:
            try:
                socket.create_connection(("127.0.0.1", port)).close()
                return
            except OSError:
                if self._process.poll() is not None or time.monotonic() > end:
                    raise RuntimeError("HAProxy did not start:\n" + self.log.read_text()) from None
                time.sleep(0.01)

    def resident_mb(self):
        return resident_mb(self._process)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait(FEW_S)
        self._folder.cleanup()


def load_command(server, *flags, tenant=None, address=None):
    token = [f"--token-file={server.token_file(tenant)}"] if tenant else []
    return [BIN / "drape", "load", f"--server={address or server.address}", "--json", *token, *map(str, flags)]


def load(server, *flags, **where):
    """The last level of `drape load`; raises if it could not measure. where: tenant, or the address of a proxy."""
    done = subprocess.run(load_command(server, *flags, **where), capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{done.args} ended with {done.returncode}:\n{done.stderr[-2000:]}")
    return json.loads(done.stdout)[-1]


class Beside:
    """Processes that load the server while something else is measured; ends them with its block."""

    def __init__(self, commands, settle_s=2.0):
        self._log = tempfile.TemporaryFile()
        self._processes = [subprocess.Popen(c, stdout=subprocess.DEVNULL, stderr=self._log) for c in commands]
        time.sleep(settle_s)

    def __enter__(self):
        dead = [p.args for p in self._processes if p.poll() is not None]
        if dead:
            self.__exit__()
            self._log.seek(0)
            raise RuntimeError(f"ended before it was measured: {dead[0]}:\n{self._log.read()[-2000:].decode()}")
        return self

    def __exit__(self, *_):
        for process in self._processes:
            process.kill()
        for process in self._processes:
            process.wait()
