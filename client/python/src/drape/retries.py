"""Which requests are sent again when they got no answer, when, and how often."""

from __future__ import annotations

import dataclasses
import math
import random
import threading
import time
import uuid

from . import checks, errors

# Requests that change nothing, or the same however often they are done.
_IDEMPOTENT = frozenset(("GetServerInfo", "Check", "GetSession", "ListSessions", "RenewSession", "GetCloth", "ListCloths",
                         "ReadStates", "ReadTopology", "Render", "ExportCloths"))
# Parts of a Step that would be applied once more, whatever its guards say.
APPLIED = ("pin_controls", "rest_length_controls", "rest_length_scales", "collider_controls", "grip_controls", "resets", "loads")
# As gRPC throttles its own retries (A6): an answer makes up for a tenth of a failure.
_REFILL = 0.1
# Pauses are longer or shorter by up to this part, so that clients of one server do not all come back at once.
_JITTER = 0.2
_MOST_TRIES = 2**32 - 1
_MOST_DOUBLINGS = 100  # of a pause: beyond any max_pause_s that somebody waits for, and no number overflows


@dataclasses.dataclass(frozen=True)
class Retries:
    """What a connection sends again by itself: requests that got no answer, if they change nothing, have a request id,
    or are steps with `expected` or `until` and without controls; and requests of any kind for which there was no
    connection, or to which the server answers with the time after which to ask again. Always within `timeout_s` of the
    request, with the same request id.

    tries: how often a request is sent at most, a whole number >= 1. first_pause_s [s], >= 0: after the first sending without
    an answer; each further one is twice as long, at most max_pause_s [s], >= 0. budget, >= 0: each failure takes 1 from the
    connection's budget, each answer gives 0.1 back; at half of it and below nothing is sent again. request_ids: give one to
    everything that changes cloths or saved states and has none, pipelines left out, so that it can be sent again, too.
    Raises InvalidArgument.
    """

    tries: int = 6
    first_pause_s: float = 0.1
    max_pause_s: float = 2.0
    budget: float = 20.0
    request_ids: bool = False

    def __post_init__(self):
        checks.whole("tries", self.tries, 1, _MOST_TRIES)
        for name in ("first_pause_s", "max_pause_s", "budget"):
            checks.not_negative(name, getattr(self, name))
        if not isinstance(self.request_ids, bool):
            raise errors.bad_field("request_ids", f"{self.request_ids!r} is not True or False")


class Budget:
    """What a connection may spend on sending again. Safe to use from several threads."""

    def __init__(self, size):
        self._size = self._left = size
        self._lock = threading.Lock()

    def refill(self):
        """A request got its answer."""
        if self._left < self._size:
            with self._lock:
                self._left = min(self._size, self._left + _REFILL)

    def take(self):
        """A request failed. True: something may be sent again."""
        with self._lock:
            self._left = max(0, self._left - 1)
            return self._left > self._size / 2


def is_repeatable(call):
    """It does no harm if the call arrives twice: it changes nothing, or the server knows it again."""
    if call.method in _IDEMPOTENT or getattr(call.request, "request_id", ""):
        return True
    request = call.request
    return (call.method in ("Step", "StepInChunks") and (request.HasField("expected_step") or request.HasField("until_step"))
            and not any(request.HasField(name) for name in APPLIED))


def give_id(request):
    """An id of its own, if it can have one and has none."""
    if getattr(request, "request_id", None) == "":
        request.request_id = uuid.uuid4().hex


def changes_something(call):
    """So that it matters whether it was done."""
    return call.method not in _IDEMPOTENT


class Tries:
    """The sendings of one call. timeout_s: of all of them together; None: no limit."""

    def __init__(self, options, budget, call, timeout_s):
        self._options = options
        self._budget = budget
        self._call = call
        self._end = None if timeout_s is None or timeout_s == math.inf else time.monotonic() + timeout_s
        self._sent = 0  # without those that found an earlier one under way
        self._pauses = 0
        self.unanswered = 0  # of a call that changes something: those that may have been done

    def doubt(self, error):
        """What to tell with the error that ends the call; "": nobody doubts whether it was done."""
        if not isinstance(error, errors.Unavailable) or error.is_unsent or error.reason or not changes_something(self._call):
            return ""
        if self._call.method in ("Step", "StepInChunks") and not is_repeatable(self._call):
            return ("; the step may have been done: read `step_count`; with `until`, and without controls, a step is sent again "
                    "without harm")
        return "" if self.unanswered else "; it may have been done"

    def left_s(self):
        """The time of the next sending."""
        return None if self._end is None else max(0, self._end - time.monotonic())

    def has_brought_something(self):
        """The next sending goes on where this one was cut."""
        self._sent = self._pauses = 0

    def pause_after(self, error):
        """How long to wait before the next sending; None: there is none, and the call ends with this error."""
        pause_s = self._pause_after(error)
        if pause_s is None or (self._end is not None and time.monotonic() + pause_s >= self._end):
            return None
        return pause_s

    def _pause_after(self, error):
        options, asked_s = self._options, error.retry_after_s
        # The server is at it: the answer takes as long as it would have taken the first sending.
        if asked_s is not None and error.reason == "REQUEST_IN_PROGRESS" and options.tries > 1:
            return asked_s * random.uniform(1, 1 + _JITTER)
        if asked_s is None and not isinstance(error, errors.Unavailable):
            return None
        is_within_budget = self._budget.take()
        self._sent += 1
        if self._sent >= options.tries or not is_within_budget:
            return None
        if asked_s is not None:  # who asks to wait has done nothing, so that any request may be sent again
            return asked_s * random.uniform(1, 1 + _JITTER)
        if not error.is_unsent:
            if not is_repeatable(self._call):
                return None
            self.unanswered += changes_something(self._call)
        nominal_s = min(options.max_pause_s, options.first_pause_s * 2.0 ** min(self._pauses, _MOST_DOUBLINGS))
        self._pauses += 1
        return nominal_s * random.uniform(1 - _JITTER, 1 + _JITTER)
