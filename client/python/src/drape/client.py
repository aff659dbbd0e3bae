"""A connection to one server."""

from __future__ import annotations

import reprlib
import warnings
import weakref
from typing import Any

import numpy as np
from google.protobuf import wrappers_pb2

from . import checks, errors, v1
from ._version import __version__
from .connection import HEALTH, REQUEST_TIMEOUT_S, Connection
from .operations import Operation, Route, Unary, blocking, with_more
from .private_server import PrivateServer
from .retries import Retries
from .session import Session

_SESSIONS_PER_PAGE = 1000
_SERVING = 1  # of grpc.health.v1.HealthCheckResponse


class VersionWarning(UserWarning):
    """The server is of another version than this package: what one of them does not know is ignored or refused."""


class ClientBase:
    """A connection to one server. address: HOST:PORT. info: what the server is and allows, as of connecting."""

    _session_class: Any

    def __init__(self, connection):
        self._connection = connection
        self._open_sessions = weakref.WeakSet()
        self.info = None

    def _introduce(self, ready_timeout_s) -> Operation[None]:
        """The first request: waits for the server, and compares the versions."""
        try:
            self.info = yield Unary("GetServerInfo", v1.GetServerInfoRequest(), timeout_s=ready_timeout_s)
        except errors.Unavailable as error:
            error.message = f"no Drape server answers at {self.address}: {error.message}"
            error.reason = error.reason or "CANNOT_CONNECT"
            raise
        if self.info.version.split(".")[:2] != __version__.split(".")[:2]:
            warnings.warn(f"the server at {self.address} has version {self.info.version}, this package {__version__}",
                          VersionWarning, stacklevel=6)
        self.dtype = np.dtype("<f8" if self.info.precision == "float64" else "<f4")

    @property
    def address(self) -> str:
        """HOST:PORT of the server."""
        return self._connection.address

    def __repr__(self):
        about = f"{self.info.backend} on {self.info.device}" if self.info else "not connected"
        return f"<drape server at {self.address}: {about}>"

    def _session(self, *, name: str | None = None, ttl_s: float | None = None, display_name: str = "") -> Operation[Session]:
        """A new session; or, with `name`, one that exists, which then is not deleted from here.

        ttl_s: the lease [s] of a new one, 1 to 86400; None: the server's default. display_name: of a new one, free text for
        operators. One that exists keeps its own.
        Raises InvalidArgument, SessionLost, ResourceExhausted (TOO_MANY_SESSIONS).
        """
        if name is None:
            message = yield Unary("CreateSession", checks.message(v1.CreateSessionRequest, ttl_s=ttl_s, display_name=display_name))
        else:
            route = Route(checks.text("name", name))
            for field, is_given in (("ttl_s", ttl_s is not None), ("display_name", bool(display_name))):
                if is_given:
                    raise errors.bad_field(field, "is for a new session; the one of this name keeps its own")
            try:
                message = yield Unary("GetSession", v1.GetSessionRequest(name=name), route)
            except errors.SessionLost as error:
                error.message += f": {reprlib.repr(name)}"  # not all of it: a name gives access
                raise
        session = self._session_class(self, message, is_owner=name is None)
        self._open_sessions.add(session)
        return session

    def _sessions(self) -> Operation[list[v1.Session]]:
        """All sessions of the server, with shortened names. Raises Unavailable, Unauthenticated."""
        sessions, token = [], ""
        while True:
            page = yield Unary("ListSessions", v1.ListSessionsRequest(page_size=_SESSIONS_PER_PAGE, page_token=token))
            sessions.extend(page.sessions)
            token = page.next_page_token
            if not token:
                return sessions

    def _server_info(self) -> Operation[v1.ServerInfo]:
        """What the server is, allows and holds at present. Raises Unavailable, Unauthenticated."""
        return (yield Unary("GetServerInfo", v1.GetServerInfoRequest()))

    def _health(self) -> Operation[bool]:
        """True while the server takes requests; False while it drains. Raises Unavailable without an answer."""
        status = yield Unary(HEALTH, wrappers_pb2.StringValue())
        return status.value == _SERVING


class Client(ClientBase):
    __doc__ = with_more(ClientBase.__doc__, """
    Made by `drape.launch` and `drape.connect`. Safe to use from several threads, not in a forked process. `with` and
    `close()` end the connection, and a private server.
    """)

    _session_class = Session

    def __init__(self, connection, ready_timeout_s):
        super().__init__(connection)
        self._closing = weakref.finalize(self, connection.close)
        try:
            connection.run(self._introduce(ready_timeout_s))
        except BaseException:
            self.close()
            raise

    session = blocking(ClientBase._session)
    sessions = blocking(ClientBase._sessions)
    server_info = blocking(ClientBase._server_info)
    health = blocking(ClientBase._health)

    def close(self) -> None:
        """Closes its sessions, the connection, and the private server. May be called again."""
        for session in list(self._open_sessions):
            session.close()
        self._closing()

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_):
        self.close()


def connect(address: str, *, tls: bool | bytes | str = False, certificate: tuple | None = None,
            token: str | None = None, timeout_s: float | None = REQUEST_TIMEOUT_S, ready_timeout_s: float | None = 5.0,
            retries: Retries | None = Retries()) -> Client:
    """Connects to a server at HOST:PORT and waits until it answers.

    tls: False (only for servers of this machine and of private networks), True (certificates of the system), or the
    certificates to trust: PEM bytes, or a file. certificate: a pair of this client's own chain and key, each PEM bytes
    or a file, for servers that ask for it. token: the tenant's, for servers that want one; give it only together
    with TLS, or to a server of this machine. timeout_s: limit of every single request that is not a stream
    (pipelines, runs and frames are streams), 3600 by default; None: none. A step that takes longer is given its own:
    `step(…, timeout_s=math.inf)`. ready_timeout_s: how long to wait for the first answer; None: as long as timeout_s.
    retries: what is sent again when a connection fails; None: nothing.
    Raises InvalidArgument, Unavailable (CANNOT_CONNECT), Unauthenticated (INVALID_TOKEN), FailedPrecondition
    (TLS_FILE_FAILED).
    """
    return Client(Connection(address, tls, timeout_s, token=token, certificate=certificate, retries=retries),
                  ready_timeout_s)


def launch(backend: str = "auto", *, program: str | None = None, flags=(), ready_timeout_s: float | None = 60.0,
           timeout_s: float | None = REQUEST_TIMEOUT_S, retries: Retries | None = Retries()) -> Client:
    """Starts a private server on a free port of this machine; it ends with the client, and with this process, however
    that ends.

    backend: "auto", "gl", "cpu" or "reference". program: the server; None: see `drape.find_server`. flags: further ones
    for it, e.g. ["--threads=4"]. ready_timeout_s: how long to wait until it listens; None: without end. timeout_s, retries:
    see `connect`. Raises InvalidArgument for a backend or flags that
    the server refuses, NotFound (NO_SERVER_PROGRAM), Unavailable with the end of the server's log.
    """
    server = PrivateServer(backend, program, flags, ready_timeout_s)
    return Client(Connection(server.address, timeout_s=timeout_s, server=server, retries=retries), ready_timeout_s)
