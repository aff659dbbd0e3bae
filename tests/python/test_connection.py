"""Hosts that vanish without a word while a request is under way, and servers that never answer."""

import asyncio
import contextlib
import math
import queue
import select
import socket
import threading
from concurrent import futures

import grpc
import pytest

import drape
import drape.aio
from drape.operations import Route, Unary
from drape.session import iter_of

LONG = Unary("Step", drape.v1.StepRequest(session="s", steps=1), Route("s"))


class Busy(grpc.GenericRpcHandler):
    """A server that is at every request for as long as the test lasts, but for the first one of a client."""

    def __init__(self):
        self.is_over = threading.Event()
        self.left_s = queue.SimpleQueue()  # until each request that is under way is given up by its client; None: never

    def service(self, details):
        def answer(request, context):
            if details.method.endswith("GetServerInfo"):
                return drape.v1.ServerInfo(version=drape.__version__)
            self.left_s.put(context.time_remaining())
            self.is_over.wait()
            return drape.v1.StepResponse()

        if details.method.endswith("StepStream"):
            return grpc.stream_unary_rpc_method_handler(answer, response_serializer=lambda message: message.SerializeToString())
        return grpc.unary_unary_rpc_method_handler(answer, response_serializer=lambda message: message.SerializeToString())


class Cable:
    """Passes bytes on to a server until it is pulled out: then it takes and brings nothing, and stays open."""

    def __init__(self, port):
        self._port = port
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self.sent = queue.SimpleQueue()  # what clients have sent, piece by piece
        self.is_out = threading.Event()
        threading.Thread(target=self._pass, daemon=True).start()

    def _pass(self):
        with self._listener, self._listener.accept()[0] as client, socket.create_connection(("127.0.0.1", self._port)) as server:
            while not self.is_out.is_set():
                for end in select.select([client, server], [], [], 0.01)[0]:
                    data = end.recv(65536)
                    if not data:
                        return
                    if end is client:
                        self.sent.put(len(data))
                    (server if end is client else client).sendall(data)
            threading.Event().wait()


@pytest.fixture
def busy():
    busy = Busy()
    server = grpc.server(futures.ThreadPoolExecutor(2), options=[
        ("grpc.http2.min_ping_interval_without_data_ms", 10), ("grpc.http2.max_ping_strikes", 0)])
    server.add_generic_rpc_handlers((busy,))
    busy.port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    yield busy
    busy.is_over.set()
    server.stop(0)


@pytest.fixture
def cable(busy):
    return Cable(busy.port)


def ask(address):
    with drape.connect(address, retries=None) as client:
        client._connection.run(iter_of(LONG))


def ask_by_coroutine(address):
    async def program():
        async with await drape.aio.connect(address, retries=None) as client:
            await client._connection.run(iter_of(LONG))

    asyncio.run(program())


@pytest.mark.parametrize("asking", [ask, pytest.param(ask_by_coroutine, marks=pytest.mark.full)])
def test_a_host_that_vanishes_in_a_long_request_is_noticed(cable, monkeypatch, asking):
    monkeypatch.setattr("drape.connection.KEEPALIVE_MS", 50)
    monkeypatch.setattr("drape.connection.KEEPALIVE_TIMEOUT_MS", 2000)
    ends = queue.SimpleQueue()

    def run():
        try:
            ends.put(asking(cable.address))
        except drape.Error as error:
            ends.put(error)

    threading.Thread(target=run, daemon=True).start()
    pings = 0
    while pings < 3:  # more than may be sent without data by default
        pings = pings + 1 if cable.sent.get(timeout=30) == 17 else 0  # bytes of a ping, when it comes alone
    assert ends.empty()
    cable.is_out.set()
    error = ends.get(timeout=30)
    assert isinstance(error, drape.Unavailable), error


def test_servers_accept_the_pings_of_clients():
    """One every 10 s (server/api/grpc_server.cpp); the answer has more time than the server gives its own."""
    options = dict(drape.connection.channel_options("host:7743"))
    assert options["grpc.keepalive_time_ms"] == 30_000 and options["grpc.keepalive_timeout_ms"] == 20_000


NEVER_S = 1e8  # gRPC tells servers of a far end in place of none


def in_background(asking, *arguments):
    def run():
        with contextlib.suppress(drape.Error):
            asking(*arguments)

    threading.Thread(target=run, daemon=True).start()


@pytest.mark.parametrize("asking", [ask, ask_by_coroutine])
def test_a_request_has_an_hour_unless_told_otherwise(busy, asking):
    in_background(asking, f"127.0.0.1:{busy.port}")
    assert 3500 < busy.left_s.get(timeout=30) < 3700  # gRPC rounds it up


@pytest.mark.parametrize("of_client, of_request, least_s, most_s", [
    (2.0, None, 0, 3), (2.0, 600, 500, 700), (2.0, math.inf, NEVER_S, math.inf), (None, None, NEVER_S, math.inf)])
def test_the_limit_of_the_request_comes_before_that_of_the_client(busy, of_client, of_request, least_s, most_s):
    def ask_within():
        with drape.connect(f"127.0.0.1:{busy.port}", retries=None, timeout_s=of_client) as client:
            client._connection.run(iter_of(LONG._replace(timeout_s=of_request)))

    in_background(ask_within)
    assert least_s < busy.left_s.get(timeout=30) <= most_s


def test_streams_have_no_limit(busy):
    with drape.connect(f"127.0.0.1:{busy.port}", retries=None) as client:
        call, requests = client._connection.open_stream("StepStream", Route("s"))
        assert busy.left_s.get(timeout=30) > NEVER_S
        requests.put(None)
        call.cancel()
