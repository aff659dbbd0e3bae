"""Steps through one stream, several under way."""

from __future__ import annotations

import collections
import queue

import grpc

from . import columns, errors, states


class Pipeline:
    """`with cloths.pipeline() as steps: answer = steps.step()`. The requests are done in order. An error ends the stream.

    With `depth` d, `step` returns the answer to the step d - 1 calls before, None while there is none; `drain` the rest.
    Do not step the same cloths in another way before the end.
    """

    def __init__(self, cloths, depth):
        if not 1 <= depth <= 16:
            raise errors.bad_field("depth", f"{depth} is not within 1 and 16")
        self._cloths = cloths
        self._depth = depth
        self._under_way = collections.deque()
        self._requests = queue.SimpleQueue()
        connection = cloths._connection
        self._answers = connection.call_of("StepStream")(
            iter(self._requests.get, None), metadata=connection.metadata_of(cloths._session.name))

    def step(self, steps: int = 1, *, view=states.POSITIONS, report: bool = False, ids=None) -> states.Answer | None:
        """Sends a step; see `Cloths.step` for its arguments."""
        cloths = self._cloths
        rows = columns.rows_of(ids, cloths.num)
        if rows is not None and not len(rows):
            raise errors.bad_field("ids", "nothing is selected")
        request = cloths._step_request(steps, states.view_of(view), report, rows, None, None)
        cloths._forget_states()
        self._requests.put(request)
        self._under_way.append((rows, request))
        return self._next() if len(self._under_way) >= self._depth else None

    def drain(self) -> list:
        """Waits for the answers to all steps under way."""
        return [self._next() for _ in range(len(self._under_way))]

    def close(self) -> None:
        """Cancels what is under way. Steps that the server has begun may be done."""
        self._requests.put(None)
        self._answers.cancel()
        if self._under_way:
            self._under_way.clear()
            self._cloths._forget_states()

    def _next(self):
        try:
            response = next(self._answers)
        except StopIteration:
            raise errors.Unavailable("the server ended the stream", reason="STREAM_ENDED") from None
        except grpc.RpcError as error:
            self._under_way.clear()
            raise self._cloths._connection.error_of(error) from None
        rows, request = self._under_way.popleft()
        answer = self._cloths._take(response, rows, request)
        if self._under_way:  # what the batch knows would be older than what is under way
            self._cloths._forget_states()
        return answer

    def __enter__(self) -> Pipeline:
        return self

    def __exit__(self, kind, value, trace):
        try:
            if kind is None:
                self.drain()
        finally:
            self.close()
