import asyncio
import pickle
import re
import traceback

import grpc
import numpy as np
import pytest
from google.rpc import error_details_pb2, status_pb2

import drape
import drape.aio
from conftest import ROOT, sheet
from drape import errors


def test_every_code_of_the_protocol_has_a_class():
    table = (ROOT / "proto/errors.md").read_text()
    codes = set(re.findall(r"^\| ([A-Z_]{6,}) \|", table, flags=re.MULTILINE))
    assert len(codes) >= 6
    assert codes <= set(errors._CLASSES)


def test_a_bad_field_has_its_path_and_its_range(session):
    bad = sheet()
    bad.grid.columns = 0
    with pytest.raises(drape.InvalidArgument) as caught:
        session.create(bad)
    error = caught.value
    assert isinstance(error, ValueError)
    assert error.reason == "INVALID_FIELDS" and error.code == "INVALID_ARGUMENT"
    assert error.fields[0].field == "spec.grid.columns"
    assert ">= 1" in error.fields[0].description
    assert str(error) == "INVALID_FIELDS: spec.grid.columns: 0 is not >= 1"


def test_long_messages_are_told_once(session):
    """The server cuts them, and the descriptions of their fields at another length."""
    cloths = session.create(sheet(), 2)
    with pytest.raises(drape.InvalidArgument) as caught:
        cloths.update(drape.ClothSpec(), ["foo"])
    (field,) = caught.value.fields
    assert str(caught.value) == f"INVALID_FIELDS: {field.field}: {field.description}" and field.description.endswith("settings")
    with pytest.raises(drape.InvalidArgument) as caught:
        cloths.write(np.full((2, 36, 3), np.nan))
    told = "nan, nan, nan are not within 1e+06 m of the cloth's middle (cloth 0 of the batch)"
    assert str(caught.value) == f"INVALID_FIELDS: {'; '.join(f'positions_m[{k}]: {told}' for k in range(3))}; and 13 more"


FIELDS = [("a", "is wrong"), ("b", "is 1...")]


@pytest.mark.parametrize("message, expected", [
    ("a: is wrong; b: is 12345", "a: is wrong; b: is 12345"), ("a: is wrong; b: is 123...", "a: is wrong; b: is 123..."),
    ("a: is wrong; b: is 1...", "a: is wrong; b: is 1..."), ("a: is wrong; b: i...", "a: is wrong; b: is 1..."),
    ("a: is wrong; ...", "a: is wrong; b: is 1..."), ("a: is wrong;...", "a: is wrong; b: is 1..."),
    ("a: is wrong...", "a: is wrong; b: is 1..."), ("a: is w...", "a: is wrong; b: is 1..."),
    ("something else...", "something else..."), ("", "")])
def test_what_the_server_cut_is_completed(message, expected):
    found, details = errors._completed(message, {"fields": FIELDS})
    assert found == expected and details["fields"][0] == FIELDS[0] and details["fields"][1][1].startswith("is 1")
    told = "; ".join(f"{field}: {description}" for field, description in details["fields"])
    assert told == expected or not expected.startswith("a")


def test_a_traceback_tells_of_the_error_alone(session):
    """Not of gRPC's, which says the same in many lines."""
    with pytest.raises(drape.InvalidArgument) as caught:
        session.create(drape.ClothSpec())
    text = "".join(traceback.format_exception(caught.value))
    assert "drape.errors.InvalidArgument: INVALID_FIELDS: spec" in text
    assert "InactiveRpcError" not in text and "another exception" not in text


class Reset(grpc.RpcError):
    """A stream that a proxy reset right after its end had come."""

    def __init__(self, trailers):
        self._trailers = trailers

    def code(self):
        return grpc.StatusCode.CANCELLED

    def details(self):
        return "Received RST_STREAM with error code 8"

    def trailing_metadata(self):
        return self._trailers


def test_the_code_of_the_server_counts_when_a_stream_was_reset_behind_it():
    status = status_pb2.Status(code=grpc.StatusCode.NOT_FOUND.value[0], message="no cloth 7 in this session")
    status.details.add().Pack(error_details_pb2.ErrorInfo(reason="CLOTH_NOT_FOUND"))
    error = errors.from_rpc(Reset([("grpc-status-details-bin", status.SerializeToString())]))
    assert isinstance(error, drape.NotFound) and error.code == "NOT_FOUND"
    assert str(error) == "CLOTH_NOT_FOUND: no cloth 7 in this session"
    assert isinstance(errors.from_rpc(Reset([])), drape.Cancelled)


def test_every_bad_field_is_named(session):
    bad = sheet(material=drape.Material(areal_density_kg_per_m2=-1, friction_static=-2))
    with pytest.raises(drape.InvalidArgument) as caught:
        session.create(bad)
    assert {field for field, _ in caught.value.fields} >= {
        "spec.material.areal_density_kg_per_m2", "spec.material.friction_static"}


def test_of_bad_fields_of_a_batch_the_text_has_the_first_few(session):
    cloths = session.create(sheet(), count=50)
    cloths.move_pins([0], [0, float("inf"), 0])
    with pytest.raises(drape.InvalidArgument) as caught:
        cloths.step()
    assert len(caught.value.fields) >= 5
    assert "[7]" in str(caught.value) and "[10]" not in str(caught.value)
    assert str(caught.value).endswith(f"; and {len(caught.value.fields) - 3} more")


def test_a_quota_names_its_limit(client):
    with client.session() as session, pytest.raises(drape.ResourceExhausted) as caught:
        for count in (1, client.info.limits.max_cloths_per_session):
            session.create(drape.ClothSpec(grid=drape.Grid(columns=2, rows=1, width_m=1, height_m=1)), count)
    assert caught.value.reason == "QUOTA_EXCEEDED"
    assert caught.value.quotas and caught.value.retry_after_s is None


def test_preconditions(session):
    cloths = session.create(sheet())
    with pytest.raises(drape.FailedPrecondition) as caught:
        cloths.step(expected=5)
    assert caught.value.reason == "STEP_MISMATCH"
    assert cloths.step().step_count == [1]


def test_a_session_that_is_not_there_is_named_by_its_beginning(client):
    """Its whole name gives access."""
    name = "sessions/nobody-0123456789abcdefghijklmnopqrstuvwxyz"
    with pytest.raises(drape.SessionLost, match="no such session: 'sessions/no") as caught:
        client.session(name=name)
    assert name not in str(caught.value)


def test_a_session_that_this_program_closed_is_told_so(client):
    """Cloths outlive the `with` of their session."""

    async def by_coroutines():
        async with await drape.aio.connect(client.address) as other:
            async with await other.session() as session:
                cloths = await session.create(sheet())
            await cloths.step()

    with client.session() as session:
        cloths = session.create(sheet())
    for ask in (cloths.step, lambda: session.create(sheet()), lambda: next(cloths.frames()), lambda: cloths.pipeline(1).step(),
                lambda: asyncio.run(by_coroutines())):
        with pytest.raises(drape.SessionLost, match="no such session: this program has closed it"):
            ask()


def test_lost_sessions_and_cloths_are_lookup_errors(client):
    session = client.session()
    cloths = session.create(sheet())
    cloths.delete()
    with pytest.raises(drape.NotFound) as caught:
        cloths.step()
    assert caught.value.reason == "CLOTH_NOT_FOUND" and not isinstance(caught.value, drape.SessionLost)
    session.close()
    with pytest.raises(drape.SessionLost) as caught:
        cloths.step()
    assert isinstance(caught.value, LookupError)


def test_a_deadline_is_a_timeout(session):
    cloths = session.create(sheet(64))
    with pytest.raises(TimeoutError) as caught:
        cloths.step(100_000, view=None, timeout_s=0.1)
    assert isinstance(caught.value, drape.DeadlineExceeded)
    assert str(caught.value) == ("DEADLINE_EXCEEDED: Step had no answer within timeout_s, 0.1 s; steps that were complete stay: "
                                 "`read` tells where the cloths are")
    assert cloths.step().step_count[0] < 100_001  # the batch is usable


@pytest.mark.parametrize("cls", [*set(errors._CLASSES.values()), drape.SessionLost, drape.ForkedProcess])
def test_errors_travel_between_processes(cls):
    error = cls("text", reason="WHY", fields=[("a.b", "not c")], quotas=["q"], retry_after_s=1.5, metadata={"k": "v"})
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is cls and again.__dict__ == error.__dict__
    assert str(again) == "WHY: text; a.b: not c"
