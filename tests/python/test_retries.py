"""What is sent again by itself when a connection is cut or a server does not answer."""

import asyncio
import select
import socket
import threading
from concurrent import futures

import grpc
import numpy as np
import pytest

import drape
import drape.aio
from conftest import bits, sheet
from drape import Retries
from drape.operations import Route, Unary
from drape.retries import Budget, Tries, is_repeatable
from drape.session import iter_of

QUICK = dict(first_pause_s=0.001, max_pause_s=0.05)
PATIENT = Retries(tries=100, budget=1e9, **QUICK)


class Cutter:
    """Passes bytes on to a server, and cuts the connections that exist after so many bytes more."""

    def __init__(self, address):
        host, _, port = address.rpartition(":")
        self._target = (host, int(port))
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self.cuts = 0
        self.received = 0  # by the client, since cut_once_after, when a connection was cut
        self._passed = []  # of every connection: what is left (None: no limit), what the client has received
        self._lock = threading.Lock()
        threading.Thread(target=self._accept, daemon=True).start()

    def cut_once_after(self, count):
        with self._lock:
            for passed in self._passed:
                passed[:] = count, 0

    def close(self):
        self._listener.close()

    def _accept(self):
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            with self._lock:
                self._passed.append([None, 0])
                passed = self._passed[-1]
            threading.Thread(target=self._pass, args=(client, passed), daemon=True).start()

    def _pass(self, client, passed):
        with client, socket.create_connection(self._target) as server:
            for end in (client, server):
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            while True:
                for end in select.select([client, server], [], [])[0]:
                    with self._lock:
                        try:
                            data = end.recv(4096 if passed[0] is None else min(4096, passed[0]))
                            (server if end is client else client).sendall(data)
                        except OSError:
                            data = b""
                        passed[1] += len(data) if end is server else 0
                        if passed[0] is not None:
                            passed[0] -= len(data)
                            if not passed[0]:
                                self.cuts += 1
                                self.received = passed[1]
                                return
                    if not data:
                        return


@pytest.fixture(autouse=True)
def early_pings(monkeypatch):
    """grpcio before 1.80 does not notice every cut by itself, but by the next ping of the connection."""
    monkeypatch.setattr("drape.connection.KEEPALIVE_MS", 1000)


@pytest.fixture
def cutter(client):
    cutter = Cutter(client.address)
    yield cutter
    cutter.close()


def sizes(most):
    """Of requests and answers of up to `most` bytes: everywhere."""
    size = 1
    while size < most:
        yield size
        size += 1 + size // 20


def test_a_cut_anywhere_brings_the_answer_that_is_remembered(client, session, cutter):
    cloths = session.create(sheet(16))
    cut_requests = cut_answers = 0
    with drape.connect(cutter.address, retries=PATIENT) as other, other.session(name=session.name) as same:
        mine = same.attach()
        for k, size in enumerate(sizes(6000)):
            mine.describe(0)  # the connection is there
            cuts = cutter.cuts
            cutter.cut_once_after(size)
            request_id = f"{size}-{'x' * 100}"
            answer = mine.step(request_id=request_id)
            assert answer.step_count == [k + 1], size
            assert bits(answer.positions) == bits(cloths.step(request_id=request_id).positions)
            if cutter.cuts > cuts:
                cut_requests += cutter.received == 0
                cut_answers += cutter.received > 500
    assert cut_requests > 10 and cut_answers > 10


def test_changes_without_a_request_id_get_one_if_asked(client, session, cutter):
    cloths = session.create(sheet(16))
    options = Retries(tries=100, budget=1e9, request_ids=True, **QUICK)
    with drape.connect(cutter.address, retries=options) as other, other.session(name=session.name) as same:
        mine = same.attach()
        for k, size in enumerate(sizes(6000)):
            cutter.cut_once_after(size)
            assert mine.step().step_count == [k + 1], size
        cutter.cut_once_after(800)
        snapshot = mine.snapshot()
        cutter.cut_once_after(800)
        assert same.restore(snapshot).num == 1
        assert len(session.list()) == 2
        cutter.cut_once_after(50)
        mine.delete()
    assert len(session.list()) == 1 and cutter.cuts > 20
    with pytest.raises(drape.NotFound):
        cloths.step()


def test_steps_that_nobody_would_know_again_are_not_repeated(client, session, cutter):
    session.create(sheet(16))
    with drape.connect(cutter.address, retries=PATIENT) as other, other.session(name=session.name) as same:
        mine = same.attach()
        mine.step()
        cutter.cut_once_after(20)
        with pytest.raises(drape.Unavailable, match="the step may have been done: read `step_count`; with `until`") as raised:
            mine.step()
        assert raised.value.unanswered_tries == 0


def test_coroutines_repeat_the_same(client, session, cutter):
    session.create(sheet(16))

    async def program():
        async with await drape.aio.connect(cutter.address, retries=PATIENT) as other:
            mine = await (await other.session(name=session.name)).attach()
            for k, size in enumerate(sizes(6000)):
                cutter.cut_once_after(size)
                assert (await mine.step(request_id=f"aio-{size}")).step_count == [k + 1]
                cutter.cut_once_after(size)
                assert (await mine.read()).step_count == [k + 1]

    asyncio.run(program())
    assert cutter.cuts > 50


def test_large_answers_that_are_cut_come_again(client, session, cutter):
    session.create(sheet(320, settings=drape.StepSettings(substeps=1, max_iterations=1)))  # 1.2 MB in two chunks
    with drape.connect(cutter.address, retries=PATIENT) as other, other.session(name=session.name) as same:
        mine = same.attach()
        for k, size in enumerate((100, 5_000, 500_000, 1_000_000, 1_100_000, 1_200_000)):
            mine.describe(0)  # the connection is there
            cutter.cut_once_after(size)
            answer = mine.step(request_id=f"large-{size}", report=True)
            assert answer.step_count == [k + 1] and len(answer.reports) == 1
            assert np.array_equal(answer.positions, mine.read().positions)
    assert cutter.cuts == 6


class Away(grpc.GenericRpcHandler):
    """A server that answers GetSession alone, and that only from the n-th time on."""

    def __init__(self):
        self.calls = 0
        self.refused = 0

    def service(self, details):
        def answer(request, context):
            if details.method.endswith("GetServerInfo"):
                return drape.v1.ServerInfo(version=drape.__version__)
            self.calls += 1
            if self.calls <= self.refused:
                context.abort(grpc.StatusCode.UNAVAILABLE, "not now")
            return drape.v1.Session(name="s", ttl_s=300)

        return grpc.unary_unary_rpc_method_handler(answer, response_serializer=lambda message: message.SerializeToString())


@pytest.fixture
def away():
    server = grpc.server(futures.ThreadPoolExecutor(2))
    handler = Away()
    server.add_generic_rpc_handlers((handler,))
    handler.address = f"127.0.0.1:{server.add_insecure_port('127.0.0.1:0')}"
    server.start()
    yield handler
    server.stop(0)


LOOK = Unary("GetSession", drape.v1.GetSessionRequest(name="s"), Route("s"))


def test_a_request_is_sent_again_within_its_tries(away):
    with drape.connect(away.address, retries=Retries(tries=3, **QUICK)) as client:
        away.refused = 2
        client._connection.run(iter_of(LOOK))
        assert away.calls == 3
        away.refused = 6
        with pytest.raises(drape.Unavailable) as raised:
            client._connection.run(iter_of(LOOK))
        assert str(raised.value) == "UNAVAILABLE: not now" and away.calls == 6, "who looks does not care whether it was done"
        away.refused = 9
        with pytest.raises(drape.Unavailable, match="not now; sent 2 times before without an answer: it may have") as raised:
            client._connection.run(iter_of(Unary("DeleteCloths", drape.v1.DeleteClothsRequest(request_id="a"))))
        assert raised.value.unanswered_tries == 2 and away.calls == 9


def test_nothing_is_sent_again_without_retries(away):
    with drape.connect(away.address, retries=None) as client:
        away.refused = 1
        with pytest.raises(drape.Unavailable):
            client._connection.run(iter_of(LOOK))
        assert away.calls == 1


def test_what_was_never_sent_is_sent_until_somebody_is_there(restarted):
    with drape.connect(restarted.address, retries=Retries(tries=1000, budget=1e9, **QUICK)) as client:
        session = client.session()
        cloths = session.create(sheet())
        restarted.drain()
        starting = threading.Timer(0.5, restarted.start)
        starting.start()
        # Refused connections, then a server that has it from its file: nothing is done, nor may it have been.
        with pytest.raises(drape.StateLost) as raised:
            cloths.step()
        starting.join()
        assert raised.value.unanswered_tries == 0 and "may have been done" not in str(raised.value)
        session.reattach()
        assert cloths.step().step_count == [1]


def test_nobody_doubts_what_was_never_sent(restarted):
    with drape.connect(restarted.address, retries=Retries(tries=3, **QUICK)) as client, client.session() as session:
        cloths = session.create(sheet())
        restarted.drain()
        for ask in (cloths.step, lambda: cloths.step(request_id="a"), cloths.read, session.reattach):
            with pytest.raises(drape.Unavailable) as raised:
                ask()
            assert raised.value.unanswered_tries == 0 and "may have been done" not in str(raised.value)
        restarted.start()


def test_the_limit_of_the_request_holds_for_all_its_tries(away):
    with drape.connect(away.address, timeout_s=60, retries=Retries(first_pause_s=600, max_pause_s=600)) as client:
        away.refused = 1
        with pytest.raises(drape.Unavailable):
            client._connection.run(iter_of(LOOK))
        assert away.calls == 1


def test_servers_that_are_away_are_asked_a_few_times_more(away):
    with drape.connect(away.address, retries=Retries(**QUICK)) as client:
        away.refused = 10**6
        for _ in range(60):
            with pytest.raises(drape.Unavailable):
                client._connection.run(iter_of(LOOK))
    # 9 failures leave more than half of a budget of 20; the sixth one was the last of its request.
    assert away.calls == 60 + 8


def tries_of(request, method="Step", options=Retries(), budget=1e9):
    return Tries(options, Budget(budget), Unary(method, request), None)


def test_pauses_double_up_to_a_limit():
    tries = tries_of(drape.v1.DeleteClothsRequest(request_id="a"), "DeleteCloths", Retries(tries=8))
    for nominal_s in (0.1, 0.2, 0.4, 0.8, 1.6, 2, 2):
        assert 0.8 * nominal_s <= tries.pause_after(drape.Unavailable()) <= 1.2 * nominal_s
    assert tries.pause_after(drape.Unavailable()) is None and tries.unanswered == 7


def test_who_asks_to_wait_is_waited_for():
    tries = tries_of(drape.v1.StepRequest(steps=1))
    assert 0.3 <= tries.pause_after(drape.ResourceExhausted(reason="QUEUE_FULL", retry_after_s=0.3)) <= 0.36
    assert tries.pause_after(drape.ResourceExhausted(reason="QUOTA_EXCEEDED")) is None
    assert tries.pause_after(drape.FailedPrecondition(reason="STEP_MISMATCH")) is None
    assert tries.pause_after(drape.Unavailable()) is None, "a step without an id"
    tries = tries_of(drape.v1.StepRequest(request_id="a"), budget=0)
    for _ in range(100):
        assert tries.pause_after(drape.Aborted(reason="REQUEST_IN_PROGRESS", retry_after_s=0.1)) >= 0.1


@pytest.mark.parametrize("request_, expected", [
    (drape.v1.StepRequest(steps=1), False),
    (drape.v1.StepRequest(steps=1, expected_step=3), True),
    (drape.v1.StepRequest(until_step=3), True),
    (drape.v1.StepRequest(until_step=3, pin_controls=drape.v1.PinControls(particles=[1])), False),
    (drape.v1.StepRequest(until_step=3, resets=drape.v1.StepResets(cloth_ids=[1])), False),
    (drape.v1.StepRequest(steps=1, request_id="a"), True),
])
def test_a_step_is_repeatable_by_its_id_or_its_guard(request_, expected):
    assert is_repeatable(Unary("Step", request_)) is expected


def test_changes_need_an_id():
    assert not is_repeatable(Unary("DeleteCloths", drape.v1.DeleteClothsRequest()))
    assert is_repeatable(Unary("DeleteCloths", drape.v1.DeleteClothsRequest(request_id="a")))
    assert not is_repeatable(Unary("CreateSession", drape.v1.CreateSessionRequest()))


def test_the_pauses_of_any_number_of_tries_are_numbers():
    tries = tries_of(drape.v1.DeleteClothsRequest(request_id="a"), "DeleteCloths", Retries(tries=4000, budget=1e9))
    pauses = [tries.pause_after(drape.Unavailable()) for _ in range(3000)]
    assert 1.6 <= pauses[-1] <= 2.4
