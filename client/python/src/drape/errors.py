"""The exceptions of the package: one class per canonical code, and what the server said.

proto/errors.md lists every reason. A cloth that blows up is no error: see `Cloths.faulted`.
"""

from __future__ import annotations

from typing import NamedTuple

import grpc
from google.rpc import error_details_pb2, status_pb2

_DETAILS_KEY = "grpc-status-details-bin"
# What gRPC itself says of a request for which it found no connection, in all of its versions; no attribute tells it.
_NO_CONNECTION = ("failed to connect to all addresses", "connections to all backends failing", "DNS resolution failed",
                  "errors resolving ")
_CUT = "..."  # how texts end that the server has shortened
_MOST_TOLD = 4  # bad fields in the text of an error: a batch may have one of each cloth
_LOST = ("SESSION_NOT_FOUND", "SESSION_EXPIRED", "SESSION_LOST")
# Why a step was refused before it began, or not sent; WORLD_INCOMPLETE but for a cloth that joined the world meanwhile. Not
# DRAINING: it also ends steps that have begun.
_NOT_BEGUN = frozenset((
    "QUEUE_FULL", "RATE_EXCEEDED", "TOO_MANY_UNREAD_BYTES", "TOO_MANY_REQUEST_BYTES", "TOO_MANY_REQUEST_IDS",
    "DEADLINE_PASSED", "STEP_MISMATCH", "STATE_LOST", "WORLD_INCOMPLETE", "WORLD_FAULTED", "INVALID_FIELDS", "INVALID_TOKEN",
    "BAD_FIELD", "CLIENT_CLOSED", "FORKED_PROCESS"))


class FieldViolation(NamedTuple):
    """One bad field of a request: its path, and its value with the legal range."""

    field: str
    description: str


class Error(Exception):
    """Every failure of this package.

    code: canonical name, e.g. "INVALID_ARGUMENT". reason: a constant word for programs, e.g. "SESSION_EXPIRED"; ""
    where the transport failed. message: for people. fields: every bad field, by its path in the protocol; the text has the
    first few. What is about one cloth calls it by its index in its batch, whatever `ids` were asked for. quotas: the
    exhausted ones. retry_after_s: the time to wait before a repetition, None if waiting does not help.
    unanswered_tries: sendings of a request that changes something, before the last one, that had no answer: they may
    have been done. rows: of a rollout that failed, what came before, as `rollout` returns it, with fewer rows; None of
    all others.
    """

    code = "UNKNOWN"

    def __init__(self, message="", *, reason="", fields=(), quotas=(), retry_after_s=None, metadata=None, code=None,
                 unanswered_tries=0):
        super().__init__(message)
        self.code = code or type(self).code
        self.message = message
        self.reason = reason
        self.fields = tuple(FieldViolation(*field) for field in fields)
        self.quotas = tuple(quotas)
        self.retry_after_s = retry_after_s
        self.metadata = dict(metadata or {})
        self.unanswered_tries = unanswered_tries
        self.rows = None

    def __str__(self):
        told = [f"{field}: {description}" for field, description in self.fields]
        few = "; ".join(told if len(told) <= _MOST_TOLD else [*told[:_MOST_TOLD - 1], f"and {len(told) - _MOST_TOLD + 1} more"])
        message = self.message.replace("; ".join(told), few) if told else self.message
        text = f"{self.reason or self.code}: {message}"
        if few not in message:  # a message may be its fields
            text += f"; {few}"
        if self.unanswered_tries:
            times = "once" if self.unanswered_tries == 1 else f"{self.unanswered_tries} times"
            text += f"; sent {times} before without an answer: it may have been done"
        return text

    def __reduce__(self):
        return _rebuild, (type(self), self.message, self.reason, self.fields, self.quotas, self.retry_after_s,
                          self.metadata, self.code, self.unanswered_tries, self.rows)


class InvalidArgument(Error, ValueError):
    """A field is wrong; nothing has been done. `fields` names every one."""

    code = "INVALID_ARGUMENT"


class NotFound(Error, LookupError):
    """No such session or cloth."""

    code = "NOT_FOUND"


class SessionLost(NotFound):
    """The session does not exist, or its lease is over. Its cloths are gone with it. metadata: `told_step`, the highest
    step of the last answer to a step, if there was one."""


class FailedPrecondition(Error):
    """The request does not fit the present state, e.g. STEP_MISMATCH, PIN_NOT_FOUND."""

    code = "FAILED_PRECONDITION"


class StateLost(FailedPrecondition):
    """The server started again, and holds the session as it was in its last checkpoint. Nothing has been done, nor will
    be before `session.reattach()`. The message says when that was, and at which steps the cloths are now. metadata:
    `told_step`, as of SessionLost."""


class Aborted(Error):
    """The first request with this request id is not complete."""

    code = "ABORTED"


class ResourceExhausted(Error, MemoryError):
    """A limit or a quota; `retry_after_s` is set where waiting helps."""

    code = "RESOURCE_EXHAUSTED"


class Unavailable(Error, ConnectionError):
    """No answer: no server, or one that shuts down."""

    code = "UNAVAILABLE"
    is_unsent = False  # there was no connection: no server has seen the request


class DeadlineExceeded(Error, TimeoutError):
    """No answer within `timeout_s`. Steps that were complete stay."""

    code = "DEADLINE_EXCEEDED"


class Cancelled(Error):
    """The request was cancelled. Steps that were complete stay."""

    code = "CANCELLED"


class Unauthenticated(Error, PermissionError):
    """The server wants to know who asks, or refuses it."""

    code = "UNAUTHENTICATED"


class Unimplemented(Error, NotImplementedError):
    """The server, or the protocol of this package, is too old for the request."""

    code = "UNIMPLEMENTED"


class ForkedProcess(Error, RuntimeError):
    """A client was used in a process forked from the one that made it. gRPC cannot do that: make the client in the new
    process, or start processes by "spawn"."""

    code = "FAILED_PRECONDITION"


_CLASSES = {cls.code: cls for cls in (InvalidArgument, NotFound, FailedPrecondition, Aborted, ResourceExhausted,
                                      Unavailable, DeadlineExceeded, Cancelled, Unauthenticated, Unimplemented)}
_CLASSES["PERMISSION_DENIED"] = Unauthenticated
_NAMES = {code.value[0]: code.name for code in grpc.StatusCode}


def _rebuild(cls, message, reason, fields, quotas, retry_after_s, metadata, code, unanswered_tries, rows):
    error = cls(message, reason=reason, fields=fields, quotas=quotas, retry_after_s=retry_after_s, metadata=metadata,
                code=code, unanswered_tries=unanswered_tries)
    error.rows = rows
    return error


def bad_field(field, description):
    """A field that this package refuses before it asks the server."""
    return InvalidArgument(f"{field}: {description}", reason="BAD_FIELD", fields=[(field, description)])


def leaves(error, tables):
    """Whether a step that failed by `error` did nothing, and not because of what these tables of its request hold."""
    named = {field.partition(".")[0].partition("[")[0] for field, _ in error.fields}
    return error.reason in _NOT_BEGUN and not error.unanswered_tries and named.isdisjoint(tables)


def late(method, timeout_s):
    """For an error message: a request that had no answer in time."""
    stays = "; steps that were complete stay: `read` tells where the cloths are" if method.startswith("Step") else ""
    return f"{method} had no answer within timeout_s, {timeout_s:g} s{stays}"


def from_rpc(error: grpc.RpcError) -> Error:
    """The exception for a failed request, with everything that google.rpc.Status says.

    Its code counts, not gRPC's: behind some proxies a stream is reset right after its end has come, and gRPC then says
    CANCELLED, but leaves the rest as the server sent it (docker/exposed/README.md).
    """
    code = error.code() or grpc.StatusCode.UNKNOWN
    message, details = error.details() or "", {"code": code.name}
    for key, value in error.trailing_metadata() or ():
        if key == _DETAILS_KEY:
            message, details = _decode(value, message)
    cls = _CLASSES.get(details["code"], Error)
    if cls is NotFound and details.get("reason") in _LOST:
        cls = SessionLost
    if cls is FailedPrecondition and details.get("reason") == "STATE_LOST":
        cls = StateLost
    found = cls(message, **details)
    if cls is Unavailable:
        found.is_unsent = message.startswith(_NO_CONNECTION) and not found.reason
    return found


def _decode(value, message):
    status = status_pb2.Status()
    status.ParseFromString(value)
    details = {"code": _NAMES.get(status.code, "UNKNOWN")}
    for packed in status.details:
        name = packed.TypeName()
        if name == "google.rpc.ErrorInfo":
            info = error_details_pb2.ErrorInfo.FromString(packed.value)
            details.update(reason=info.reason, metadata=dict(info.metadata))
        elif name == "google.rpc.BadRequest":
            bad = error_details_pb2.BadRequest.FromString(packed.value)
            details["fields"] = [(v.field, v.description) for v in bad.field_violations]
        elif name == "google.rpc.QuotaFailure":
            quota = error_details_pb2.QuotaFailure.FromString(packed.value)
            details["quotas"] = [f"{v.subject}: {v.description}" for v in quota.violations]
        elif name == "google.rpc.RetryInfo":
            delay = error_details_pb2.RetryInfo.FromString(packed.value).retry_delay
            details["retry_after_s"] = delay.seconds + delay.nanos * 1e-9
    return _completed(status.message or message, details)


def _completed(message, details):
    """The server cuts long texts, its message and each description by itself: what one has lost the other has, so that a
    message of the fields alone is that again."""
    fields, at = list(details.get("fields", ())), 0
    is_cut, body = message.endswith(_CUT), message.removesuffix(_CUT)
    for k, (field, description) in enumerate(fields):
        start, rest = f"{field}: {description.removesuffix(_CUT)}", message[at:]
        if is_cut and len(body) - at < len(start) and start.startswith(body[at:]):
            message = "; ".join(f"{name}: {said}" for name, said in fields)
            break
        if not rest.startswith(start):
            break
        end = len(start)
        if description.endswith(_CUT):
            following = rest.find(f"; {fields[k + 1][0]}: ", end) if k + 1 < len(fields) else len(rest)
            end = following if following >= 0 else len(rest)
            fields[k] = field, rest[len(field) + len(": "):end]
        at += end + len("; ")
    return message, {**details, "fields": fields}
