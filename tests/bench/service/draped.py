"""A `draped` to be measured, and `drape load` against it."""

import hashlib
import json
import pathlib
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[3]
BIN = ROOT / "build/release/bin"
FEW_S = 60


class Draped:
    """A server with `tenants`, each with a token of its own; ends with the block that it is used in."""

    def __init__(self, *flags, tenants=()):
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
                [BIN / "draped", "--listen=127.0.0.1:0", f"--port-file={port_file}", "--backend=cpu", "--log-level=warn", *flags],
                stderr=log, stdout=log)
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
        for line in pathlib.Path(f"/proc/{self._process.pid}/status").read_text().splitlines():
            if line.startswith("VmRSS:"):
                return int(line.split()[1]) / 1000
        raise RuntimeError("no VmRSS")

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


def load_command(server, *flags, tenant=None):
    token = [f"--token-file={server.token_file(tenant)}"] if tenant else []
    return [BIN / "drape", "load", f"--server={server.address}", "--json", *token, *map(str, flags)]


def load(server, *flags, tenant=None):
    """The last level of `drape load`; raises if it could not measure."""
    done = subprocess.run(load_command(server, *flags, tenant=tenant), capture_output=True, text=True)
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
