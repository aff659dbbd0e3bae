"""The end of streams on the wire: with `x-drape-half-close` the server tells it, and waits for the client."""

import queue
import time

import grpc
import pytest

import drape
from conftest import sheet
from drape import v1
from drape.connection import HALF_CLOSE_HEADER
from stream_ends import all_ends_are_told

NO_CLOTH = 12345
PATIENCE_S = 120
# server/api/ending_stream.h
GRACE_S = 60


class Stream:
    """A call of a method of streams, without what the client library does for it."""

    def __init__(self, client, method, first, *metadata):
        self.requests = queue.SimpleQueue()
        self.requests.put(first)
        kind = v1.METHODS[method]
        call = client._connection.channel.stream_stream(
            kind.path, request_serializer=kind.request.SerializeToString, response_deserializer=kind.answer.FromString)
        self.answers = call(iter(self.requests.get, None), metadata=metadata, timeout=PATIENCE_S)

    def end(self):
        """The code, after what is left of the messages, and the seconds for which it kept us waiting."""
        begin = time.monotonic()
        try:
            left = list(self.answers)
        except grpc.RpcError:
            left = []
        code = self.answers.code()  # waits
        self.requests.put(None)
        return left, code, time.monotonic() - begin


FIRST = {
    "Run": lambda name: v1.RunRequest(start=v1.RunRequest.Start(session=name, cloth_ids=[NO_CLOTH])),
    "StreamStates": lambda name: v1.StreamStatesRequest(
        subscribe=v1.StreamStatesRequest.Subscribe(session=name, cloth_ids=[NO_CLOTH])),
    "StepStream": lambda name: v1.StepRequest(session=name, cloth_ids=[NO_CLOTH], steps=1),
}


def test_the_client_is_told_of_every_end(client):
    all_ends_are_told(client.address)


@pytest.mark.parametrize("method", FIRST)
def test_the_status_comes_when_the_client_has_closed_its_side(client, session, method):
    stream = Stream(client, method, FIRST[method](session.name), (HALF_CLOSE_HEADER, "1"))
    last = next(stream.answers)
    assert last == type(last)(is_end=True)
    time.sleep(0.5)
    assert stream.answers.is_active()
    stream.requests.put(FIRST[method](session.name))  # what comes late is ignored
    stream.requests.put(None)
    assert stream.end()[:2] == ([], grpc.StatusCode.NOT_FOUND)


@pytest.mark.full
def test_a_client_that_does_not_close_it_gets_the_status_later(client, session):
    stream = Stream(client, "Run", FIRST["Run"](session.name), (HALF_CLOSE_HEADER, "1"))
    assert next(stream.answers).is_end
    _, code, waited_s = stream.end()
    assert code == grpc.StatusCode.NOT_FOUND and waited_s > GRACE_S - 1


def test_a_draining_server_waits_for_nobody():
    with drape.launch("cpu") as client, client.session() as session:
        stream = Stream(client, "Run", FIRST["Run"](session.name), (HALF_CLOSE_HEADER, "1"))
        frames = session.create(sheet()).frames()
        next(frames)
        assert next(stream.answers).is_end
        begin = time.monotonic()
        client._connection.server.stop()
        assert time.monotonic() - begin < GRACE_S / 2
        frames.close()


@pytest.mark.parametrize("method", FIRST)
def test_others_are_not_told(client, session, method):
    assert Stream(client, method, FIRST[method](session.name)).end()[:2] == ([], grpc.StatusCode.NOT_FOUND)


def test_a_client_that_has_closed_its_side_is_not_told(client, session):
    cloths = session.create(sheet())
    start = v1.RunRequest.Start(session=session.name, cloth_ids=cloths.ids, steps_hz=100)
    stream = Stream(client, "Run", v1.RunRequest(start=start), (HALF_CLOSE_HEADER, "1"))
    assert next(stream.answers).steps == 0
    stream.requests.put(None)
    reports, code, _ = stream.end()
    assert code == grpc.StatusCode.OK and [report.is_last for report in reports] == [True]
