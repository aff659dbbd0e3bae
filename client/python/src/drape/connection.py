"""A channel to one server, and how requests are sent through it."""

from __future__ import annotations

import os
import pathlib
import queue
import re
import ssl
import time

import grpc
import grpc.experimental
from google.protobuf import wrappers_pb2
from google.protobuf.message import Message

from . import checks, errors, memory, row_names, v1
from .retries import Budget, Retries, Tries, give_id

SESSION_HEADER = "x-drape-session"
# A server that came back from its checkpoints refuses requests that know an earlier run of it.
INCARNATION_HEADER = "x-drape-incarnation"
# A stream's last message says `is_end`, and the server waits until this client has closed its sending side: else the status
# would be lost behind HAProxy (server/api/ending_stream.h).
HALF_CLOSE_HEADER = "x-drape-half-close"
# grpc.health.v1 in terms of messages of equal wire format.
HEALTH = "Check"
_METHODS = {**v1.METHODS, HEALTH: v1.Method("/grpc.health.v1.Health/Check", wrappers_pb2.StringValue,
                                            wrappers_pb2.Int32Value, False, False)}
_MAX_REQUEST_BYTES = 64 << 20
_PRIVATE_KEY = re.compile(rb"-----BEGIN ([A-Z0-9 ]*PRIVATE KEY)-----\r?\n.+-----END \1-----", re.DOTALL)
_LOOPBACK = ("127.", "localhost:", "[::1]:")


# As in the C++ client. A server that answers pings but not the request is given up after an hour.
REQUEST_TIMEOUT_S = 3600.0
# As in the C++ client. Servers accept a ping every 10 s. grpcio before 1.80 does not notice some cuts of a connection but by
# these pings: a call then waits for up to 30 s before it is sent again (tests/python/versions.sh tries the oldest one).
KEEPALIVE_MS = 30_000
KEEPALIVE_TIMEOUT_MS = 20_000
# Between attempts to reach a server that is away: one that starts again takes a second or two.
_FIRST_RECONNECT_MS = 100
_RECONNECT_MS = 2_000


def channel_options(address):
    """For both kinds of channel: answers of any size, a connection of its own, no proxy to this machine; a host that has
    vanished without a word is noticed while a call is under way."""
    options = [
        ("grpc.max_receive_message_length", -1),
        ("grpc.max_send_message_length", _MAX_REQUEST_BYTES),
        ("grpc.use_local_subchannel_pool", 1),
        ("grpc.keepalive_time_ms", KEEPALIVE_MS),
        ("grpc.keepalive_timeout_ms", KEEPALIVE_TIMEOUT_MS),
        ("grpc.http2.ping_timeout_ms", KEEPALIVE_TIMEOUT_MS),  # what counts in younger versions of gRPC
        # A long step sends nothing but pings; by default the third one would wait for something else to be sent.
        ("grpc.http2.max_pings_without_data", 0),
        ("grpc.initial_reconnect_backoff_ms", _FIRST_RECONNECT_MS),
        ("grpc.max_reconnect_backoff_ms", _RECONNECT_MS),
    ]
    if address.startswith(_LOOPBACK):
        options.append(("grpc.enable_http_proxy", 0))
    return options


def _pem(name, given, holds):
    """PEM bytes, or those of a file, in which `holds` finds what is needed: None, or what it misses. gRPC would connect in
    vain, and say so in a log alone."""
    data = given if isinstance(given, bytes) else _bytes_of(name, given)
    missing = holds(data)
    if missing:
        told = "the bytes given have" if isinstance(given, bytes) else f"{given} has"
        raise errors.FailedPrecondition(f"{name}: {told} no {missing}", reason="TLS_FILE_FAILED")
    return data


def _certificates_missing(data):
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).load_verify_locations(cadata=data.decode("ascii", "ignore"))
    except (ssl.SSLError, ValueError) as error:
        return f"certificates in PEM, -----BEGIN CERTIFICATE-----: {error}"
    return None


def _key_missing(data):
    return None if _PRIVATE_KEY.search(data) else "private key in PEM, -----BEGIN PRIVATE KEY-----"


def _bytes_of(name, given):
    if not isinstance(given, (str, os.PathLike)):
        raise errors.bad_field(name, f"{type(given).__name__} is neither PEM bytes nor the path of a file")
    try:
        return pathlib.Path(given).read_bytes()
    except OSError as error:
        raise errors.FailedPrecondition(f"{name}: {given} cannot be read: {error}", reason="TLS_FILE_FAILED") from error


def credentials(tls, certificate=None):
    """None (no TLS), or what `connect(tls=..., certificate=...)` asks for."""
    if tls is False or tls is None:
        if certificate is not None:
            raise errors.InvalidArgument("certificate: needs tls", reason="CERTIFICATE_WITHOUT_TLS")
        return None
    if certificate is not None and not (isinstance(certificate, (tuple, list)) and len(certificate) == 2):
        raise errors.bad_field("certificate", "is not a pair of a chain and its key, each PEM bytes or the path of a file")
    chain, key = None, None
    if certificate is not None:
        chain = _pem("certificate[0]", certificate[0], _certificates_missing)
        key = _pem("certificate[1]", certificate[1], _key_missing)
    return grpc.ssl_channel_credentials(None if tls is True else _pem("tls", tls, _certificates_missing), key, chain)


class ConnectionBase:
    """What both transports share. `server` is the private one, if any: it lives as long as the connection."""

    def __init__(self, address, timeout_s, server, token, retries):
        self.address = checks.address("address", address)
        self.timeout_s = checks.seconds("timeout_s", timeout_s)
        self.server = server
        if not isinstance(retries, (Retries, type(None))):
            raise errors.bad_field("retries", f"{retries!r} is not a drape.Retries, nor None")
        self._retries = Retries(tries=1) if retries is None else retries
        self._budget = Budget(self._retries.budget)
        self.told_steps = {}  # the highest step of the last answer to a step of each session
        self.closed = False
        self._pid = os.getpid()
        self._calls = {}
        self._secrets = () if token is None else (("authorization", f"Bearer {checks.text('token', token, is_secret=True)}"),)
        memory.keep_freed_blocks()

    def __reduce__(self):
        # Of all that belongs to it, too: clients, sessions, batches.
        raise TypeError("a client of a server and what belongs to it cannot be copied or sent to another process: connect "
                        "there, and attach to the session by its name")

    def check_usable(self):
        """In this process, and not closed."""
        if os.getpid() != self._pid:
            raise errors.ForkedProcess(
                f"this client belongs to process {self._pid}; a forked process cannot use it. Make the client in the new "
                "process, or start processes by multiprocessing's 'spawn' or 'forkserver'", reason="FORKED_PROCESS")
        if self.closed:
            raise errors.FailedPrecondition("the client is closed", reason="CLIENT_CLOSED")

    def call_of(self, name):
        """The grpc callable of a method of the service."""
        self.check_usable()
        if name not in self._calls:
            method = _METHODS.get(name)
            if method is None:
                raise errors.Unimplemented(f"the protocol of this package has no {name}", reason="NO_SUCH_METHOD")
            kind = f"{'stream' if method.streams_requests else 'unary'}_{'stream' if method.streams_answers else 'unary'}"
            self._calls[name] = getattr(self.channel, kind)(
                method.path, request_serializer=method.request.SerializeToString,
                response_deserializer=method.answer.FromString)
        return self._calls[name]

    def metadata_of(self, route):
        session = ((SESSION_HEADER, route.session),) if route.session else ()
        incarnation = ((INCARNATION_HEADER, route.incarnation),) if route.incarnation else ()
        return (*session, *incarnation, *self._secrets)

    def metadata_of_stream(self, route):
        return (*self.metadata_of(route), (HALF_CLOSE_HEADER, "1"))

    def error_of(self, rpc_error, route=None, request=None):
        """The exception for a request that failed, as its caller knows the cloths."""
        error = errors.from_rpc(rpc_error)
        if route is not None and route.name_of is not None:
            row_names.told_by_row(error, request, route.name_of)
        if isinstance(error, errors.SessionLost) and route is not None and route.is_closed:
            error.message += ": this program has closed it"
        if isinstance(error, errors.Unavailable) and self.server is not None:
            error.message += self.server.why_not()
        told = None if route is None else self.told_steps.get(route.session)
        if told is not None and isinstance(error, (errors.SessionLost, errors.StateLost)):
            error.metadata["told_step"] = str(told)
            error.message += f"; the last answer to a step was about step {told}"
        return error

    # What both kinds of `ask` do around a sending. Whatever ends one, Ctrl-C too, is raised in the operation, which may
    # have something to tidy up on the server.

    def _begin(self, call):
        """The grpc callable, the call and its tries."""
        of = self.call_of(call.method)
        if self._retries.request_ids:
            give_id(call.request)
        timeout_s = self.timeout_s if call.timeout_s is None else checks.seconds("timeout_s", call.timeout_s)
        return of, call, Tries(self._retries, self._budget, call, timeout_s)

    def _sending(self, of, call, tries, request):
        return of(request, timeout=tries.left_s(), metadata=self.metadata_of(call.route))

    def _failed(self, rpc_error, call, tries):
        """After a sending that failed: how long to wait before the next one. Raises if there is none."""
        error = self.error_of(rpc_error, call.route, call.request)
        if isinstance(error, errors.DeadlineExceeded) and not error.reason:  # gRPC does not say of what
            error.message = errors.late(call.method, self.timeout_s if call.timeout_s is None else call.timeout_s)
        error.unanswered_tries = tries.unanswered
        is_over = self.server is not None and self.server.has_ended()
        pause_s = None if is_over or self.closed else tries.pause_after(error)
        if pause_s is None:
            error.message += tries.doubt(error)
            raise error from None  # it says all that gRPC's says
        return pause_s

    @staticmethod
    def _again(call, request):
        """The request of the next sending: what is left of a reading that goes on, or the same once more."""
        if getattr(call, "rest", None) is not None:
            return call.rest()
        if getattr(call, "clear", None) is not None:
            call.clear()
        return request


def iter_of_many(request):
    """A message as it is; of several, which is to be sent once more perhaps, an iterator from the first one on."""
    return request if isinstance(request, Message) else iter(request)


class Connection(ConnectionBase):
    """The transport that waits. Safe to use from several threads."""

    def __init__(self, address, tls=False, timeout_s=REQUEST_TIMEOUT_S, server=None, token=None, certificate=None,
                 retries=Retries()):
        super().__init__(address, timeout_s, server, token, retries)
        options = channel_options(address)
        # A stream of answers is read by the thread that asks for it, without another one.
        options.append((grpc.experimental.ChannelOptions.SingleThreadedUnaryStream, 1))
        secure = credentials(tls, certificate)
        self.channel = (grpc.insecure_channel(address, options) if secure is None
                        else grpc.secure_channel(address, secure, options))

    def open_stream(self, name, route):
        """The grpc call of a method with streams both ways, and the queue of its requests, which None ends. gRPC reads the
        queue in a thread of its own, which ends with the call: closed, failed or collected."""
        requests = queue.SimpleQueue()
        call = self.call_of(name)(iter(requests.get, None), metadata=self.metadata_of_stream(route))
        if not call.add_callback(lambda: requests.put(None)):
            requests.put(None)
        return call, requests

    @staticmethod
    def read(call, requests):
        """The next message of a stream. Raises StopIteration, and errors of gRPC."""
        message = next(call)
        if not message.is_end:
            return message
        requests.put(None)
        return next(call)

    def run(self, operation):
        """Does the requests that `operation` yields; returns its result."""
        try:
            call = operation.send(None)
            while True:
                try:
                    answer = self._ask(*self._begin(call))
                except BaseException as error:
                    call = operation.throw(error)
                else:
                    call = operation.send(answer)
        except StopIteration as done:
            return done.value

    def _ask(self, of, call, tries):
        sink = getattr(call, "sink", None)
        request = call.request
        while True:
            try:
                answer = (self._sending(of, call, tries, iter_of_many(request)) if sink is None
                          else self._read(of, call, tries, request))
                self._budget.refill()
                return answer
            except grpc.RpcError as error:
                pause_s = self._failed(error, call, tries)
            time.sleep(pause_s)
            request = self._again(call, request)

    def _read(self, of, call, tries, request):
        answers = self._sending(of, call, tries, request)
        try:
            for answer in answers:
                call.sink(answer)
                if call.rest is not None:
                    tries.has_brought_something()
        finally:
            answers.cancel()  # does nothing once all have come

    def close(self):
        """Ends the connection, and the private server. May be called again."""
        if self.closed or os.getpid() != self._pid:
            return
        self.closed = True
        self.channel.close()
        if self.server is not None:
            self.server.stop()
