"""Steps through one stream, several under way."""

from __future__ import annotations

import collections

import grpc

from . import checks, columns, errors, states

_MOST_UNDER_WAY = 16  # requests of a stream that the server takes


class PipelineBase:
    """`with cloths.pipeline() as steps: answer = steps.step()`. The requests are done in order. An error ends the
    stream, and takes along the controls of what was under way; steps that were sent after the one that failed may be done.

    With `depth` d, `step` returns the answer to the step d - 1 calls before, None while there is none; `drain` the
    rest. Do not step the same cloths in another way before the end.
    """

    def __init__(self, cloths, depth):
        self._cloths = cloths
        self._depth = checks.whole("depth", depth, 1, _MOST_UNDER_WAY)
        self._under_way = collections.deque()
        self._why_ended = None  # the error that a further step raises
        self._answers = self._open_call()

    def _open_call(self):
        return self._cloths._connection.open_stream("StepStream", self._cloths._route)

    def _prepare(self, steps, view, report, ids):
        """The request of a step, noted as under way; None of one of no cloths, whose answer is there when its turn comes."""
        if self._why_ended is not None:
            raise self._why_ended()
        cloths = self._cloths
        rows = columns.rows_of(ids, cloths.num)
        view = states.view_of(view)
        if rows is not None and not len(rows):
            self._under_way.append(cloths._nothing(view))
            return None
        request, _ = cloths._step_request(steps, view, report, rows, None, None)
        reader = cloths._reader_of(view, rows)
        request.in_chunks = reader is not None
        cloths._forget_states()
        self._under_way.append((rows, request, reader))
        return request

    def _is_full(self):
        return len(self._under_way) >= self._depth

    def _of_nothing(self):
        """The next answer, if it is one of no cloths."""
        return self._under_way.popleft() if isinstance(self._under_way[0], states.Answer) else None

    def _arrived(self, response):
        """The answer, if this message was the last one of it."""
        rows, request, reader = self._under_way[0]
        if reader is not None:
            if reader.take(response):
                return None
            response = reader.response
        self._under_way.popleft()
        answer = self._cloths._take(response, rows, request, reader)
        if self._under_way:  # what the batch knows would be older than what is under way
            self._cloths._forget_states()
        return answer

    def _next_request(self):
        """That of the next answer, which an error is about: the server answers in order."""
        return self._under_way[0][1] if self._under_way else None

    def _give_up(self, why):
        """Nothing comes any more. why: makes the error of further steps."""
        self._why_ended = self._why_ended or why
        if self._under_way:
            self._under_way.clear()
            self._cloths._forget_states()

    def _failed(self, error):
        """`error`, which ends the pipeline."""
        told = str(error)  # not the error: its traceback would keep alive what it names
        self._give_up(lambda: errors.FailedPrecondition(f"the pipeline has failed, by {told}; open another one by pipeline()",
                                                        reason="PIPELINE_FAILED"))
        return error

    @staticmethod
    def _closed():
        return errors.Cancelled("the pipeline is closed", reason="PIPELINE_CLOSED")

    @staticmethod
    def _ended():
        return errors.Unavailable("the server ended the stream", reason="STREAM_ENDED")


class Pipeline(PipelineBase):
    __doc__ = PipelineBase.__doc__

    def step(self, steps: int = 1, *, view=states.POSITIONS, report: bool = False, ids=None) -> states.Answer | None:
        """Sends a step; see `Cloths.step` for its arguments. Raises InvalidArgument of what cannot be sent; errors of the
        server come with the answer: those of `Cloths.step`, ResourceExhausted (TOO_MANY_STREAMS). After such an error
        further steps raise FailedPrecondition (PIPELINE_FAILED), which tells it; after `close` Cancelled
        (PIPELINE_CLOSED)."""
        request = self._prepare(steps, view, report, ids)
        if request is not None:
            self._requests.put(request)
        return self._next() if self._is_full() else None

    def drain(self) -> list:
        """Waits for the answers to all steps under way. Raises what `step` does."""
        return list(self._rest())

    def close(self) -> None:
        """Cancels what is under way. Steps that the server has begun may be done."""
        self._requests.put(None)
        self._answers.cancel()
        self._give_up(self._closed)

    def _open_call(self):
        call, self._requests = super()._open_call()
        return call

    def _rest(self):
        """The answers to all steps under way, as they come."""
        for _ in range(len(self._under_way)):
            yield self._next()

    def _next(self):
        answer = self._of_nothing()
        while answer is None:
            try:
                response = self._cloths._connection.read(self._answers, self._requests)
            except StopIteration:
                raise self._failed(self._ended()) from None
            except grpc.RpcError as error:
                told = self._cloths._connection.error_of(error, self._cloths._route, self._next_request())
                raise self._failed(told) from None
            answer = self._arrived(response)
        return answer

    def __enter__(self) -> Pipeline:
        return self

    def __exit__(self, kind, value, trace):
        try:
            if kind is None:
                self.drain()
        finally:
            self.close()
