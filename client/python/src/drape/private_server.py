"""A private server: found, started on a free port of this machine, and ended with this process, however that ends."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import math
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse
import weakref

from . import checks, errors

_DRAIN_S = 8  # for unfinished work before SIGKILL; nobody waits for its answer
_POLL_S = 0.005
_TAIL_BYTES = 4000
_USAGE_ERROR = 2  # how the server ends that cannot read its flags
_BUILT = "build/release/bin/draped"  # in a checkout

# Runs in the new process before the server: it dies with its parent, by a signal that cannot be missed. The signal
# comes when the *thread* that started it ends, so a thread stays for it (_Keeper).
_BECOME_SERVER = """
import ctypes, os, sys
PR_SET_PDEATHSIG = 1
ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, 9)
if os.getppid() != int(sys.argv[1]): os._exit(0)
os.execv(sys.argv[2], sys.argv[2:])
"""


def find_server(program=None):
    """The path of `draped`: `program`; else $DRAPE_SERVER; else that of the package drape-server; else that which is
    built in the checkout from which this package was installed; else that on PATH. Raises NotFound."""
    asked = program or os.environ.get("DRAPE_SERVER")
    if asked:
        if os.path.isfile(asked) and os.access(asked, os.X_OK):
            return os.path.abspath(asked)
        why = "" if program else ", where $DRAPE_SERVER says that it is"
        raise errors.NotFound(f"no server program at {asked}{why}", reason="NO_SERVER_PROGRAM")
    if importlib.util.find_spec("drape_server") is not None:
        import drape_server

        return str(drape_server.program())
    checkout = _checkout()
    built = None if checkout is None else checkout / _BUILT
    if built is not None and built.is_file():
        return str(built)
    found = shutil.which("draped")
    if found is None:
        raise errors.NotFound(_how_to_get_a_server(checkout), reason="NO_SERVER_PROGRAM")
    return found


def _checkout():
    """From which this package was installed, also as a copy of it; None if it is not there."""
    for client in (pathlib.Path(__file__).resolve().parents[2], _installed_from()):
        if client is not None and (client.parents[1] / "proto/drape/v1").is_dir():
            return client.parents[1]
    return None


def _installed_from():
    """The folder that pip was told of; None for a wheel."""
    try:
        text = importlib.metadata.distribution("drape-sim").read_text("direct_url.json")
    except importlib.metadata.PackageNotFoundError:
        return None
    url = urllib.parse.urlparse(json.loads(text or "{}").get("url", ""))
    path = pathlib.Path(urllib.parse.unquote(url.path))
    return path if url.scheme == "file" and len(path.parents) > 1 else None


def _how_to_get_a_server(checkout):
    build = "./run build in a checkout" if checkout is None else f"{checkout}/run build"
    wheels = "build/wheels" if checkout is None else f"{checkout}/build/wheels"
    return (f"this package has no server of its own. One of: {build}, then set DRAPE_SERVER={checkout or '/PATH'}/{_BUILT}; "
            f"or pip install --find-links {wheels} 'drape-sim[server]', whose wheels ./run wheels makes; or put draped on "
            "PATH; or drape.connect('HOST:PORT') to a server that runs")


class PrivateServer:
    """A `draped` of this process. Ready when the constructor returns."""

    def __init__(self, backend="auto", program=None, flags=(), ready_timeout_s=60):
        if isinstance(flags, str) or not all(isinstance(flag, str) for flag in flags):
            raise errors.bad_field("flags", f"a list of texts is needed, got {flags!r}")
        ready_timeout_s = checks.seconds("ready_timeout_s", ready_timeout_s)
        self._pid = os.getpid()
        self._log = tempfile.TemporaryFile()
        weakref.finalize(self, self._log.close)  # not by `stop`: errors that come later tell its end
        program = find_server(program)
        with tempfile.TemporaryDirectory(prefix="drape-") as folder:
            port_file = os.path.join(folder, "port")
            arguments = [program, "--listen=127.0.0.1:0", f"--port-file={port_file}", f"--backend={backend}", *flags]
            self._process = _Keeper(arguments, self._log).process
            self._stop = weakref.finalize(self, _stop, self._process, self._pid)
            try:
                self.address = "127.0.0.1:" + self._wait_for_port(port_file, ready_timeout_s)
            except BaseException:
                self.stop()
                raise

    @property
    def pid(self):
        return self._process.pid

    def stop(self):
        """SIGTERM; SIGKILL 8 s later. May be called again."""
        self._stop()

    def has_ended(self):
        """By itself, or by somebody else."""
        return self._process.poll() is not None

    def why_not(self):
        """For an error message: how the server ended and the end of its log; "" while it runs."""
        try:
            status = self._process.wait(0.2)  # the connection breaks a little before the process is gone
        except subprocess.TimeoutExpired:
            return ""
        how = f"was ended by {signal.Signals(-status).name}" if status < 0 else f"ended with status {status}"
        return f" (the private server {how}{self._log_tail()})"

    def _wait_for_port(self, port_file, timeout_s):
        end = math.inf if timeout_s is None else time.monotonic() + timeout_s
        previous = ""
        while True:
            try:
                with open(port_file) as file:
                    port = file.read().strip()
            except FileNotFoundError:
                port = ""
            if port and port == previous:  # two equal reads: the file is complete
                return port
            previous = port
            if self._process.poll() == _USAGE_ERROR and (said := self._log_text().partition("\n")[0]):
                raise errors.bad_field("backend" if said.startswith("--backend:") else "flags", f"the server refuses {said}")
            if self._process.poll() is not None:
                raise errors.Unavailable(f"the server ended with status {self._process.returncode} before it was ready"
                                         + self._log_tail(), reason="SERVER_ENDED")
            if time.monotonic() > end:
                raise errors.Unavailable(f"the server was not ready after {timeout_s:g} s" + self._log_tail(),
                                         reason="SERVER_NOT_READY")
            time.sleep(_POLL_S)

    def _log_text(self):
        size = self._log.seek(0, os.SEEK_END)
        self._log.seek(max(0, size - _TAIL_BYTES))
        return self._log.read().decode(errors="replace").strip()

    def _log_tail(self):
        text = self._log_text()
        return f"; the end of its log:\n{text}" if text else "; it wrote no log"


class _Keeper:
    """Starts a process from a thread that lives as long as the process."""

    def __init__(self, arguments, log):
        self.process = None
        self._error = None
        started = threading.Event()
        threading.Thread(target=self._keep, args=(arguments, log, started), name="drape-server", daemon=True).start()
        started.wait()
        if self._error is not None:
            raise errors.Unavailable(f"cannot start {arguments[0]}: {self._error}", reason="SERVER_ENDED")

    def _keep(self, arguments, log, started):
        try:
            # A session of its own: Ctrl-C of the terminal is for the client. -I -S: nothing of the user's Python.
            self.process = subprocess.Popen(
                [sys.executable, "-I", "-S", "-c", _BECOME_SERVER, str(os.getpid()), *arguments],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)
        except OSError as error:
            self._error = error
            started.set()
            return
        process = self.process
        started.set()
        process.wait()


def _stop(process, owner):
    if os.getpid() != owner or process.poll() is not None:
        return
    process.terminate()
    try:
        process.wait(_DRAIN_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


