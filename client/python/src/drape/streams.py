"""Streams of a batch: frames of its states, and steps that the server makes by itself."""

from __future__ import annotations

import dataclasses

import grpc
import numpy as np

from . import checks, columns, errors, states, v1


@dataclasses.dataclass(repr=False)
class Frame(states.States):
    """States of the cloths that a frame holds. number: of the frame, from 1. dropped: frames that a later one replaced
    since the last, because they were not read in time."""

    number: int = 0
    dropped: int = 0


class _StreamBase:
    """One bidirectional call of a batch."""

    _method = ""

    def __init__(self, cloths, *options):
        self._cloths = cloths
        self._connection = cloths._connection
        self._first = self._begin(*options)
        self._asked = self._first.ListFields()[0][1]  # what errors are about
        self._call = self._open_call()

    def _begin(self, *options):
        """The first message."""
        raise NotImplementedError

    def _open_call(self):
        return self._connection.open_stream(self._method, self._cloths._route)


class FramesBase(_StreamBase):
    """Iterate over it: each `Frame` holds the cloths that have changed. Made by `Cloths.frames`, which says what the
    iteration raises."""

    _method = "StreamStates"
    _credit = v1.StreamStatesRequest(credit=1)

    def _begin(self, every, max_hz, every_frame, velocities, queue_frames, queue_bytes):
        kind = v1.StreamStatesRequest
        checks.whole("every", every, 1, 2**32 - 1)
        self._gives_credit = not every_frame
        return kind(subscribe=checks.message(
            kind.Subscribe, session=self._cloths._session.name, cloth_ids=self._cloths._all_ids, every_n_steps=every, max_hz=max_hz,
            view=states.POSITIONS_AND_VELOCITIES if velocities else states.POSITIONS,
            delivery=kind.EVERY_FRAME if every_frame else kind.LATEST, initial_credit=0 if every_frame else 2,
            max_queued_frames=queue_frames, max_queued_bytes=queue_bytes))

    def _frame_of(self, chunks):
        cloths = self._cloths
        ids = []
        for chunk in chunks:
            firsts = chunk.first_particles or [0] * len(chunk.cloth_ids)
            ids += [cloth for cloth, first in zip(chunk.cloth_ids, firsts) if first == 0]
        names = [name for name, column in (("positions", "positions_m"), ("velocities", "velocities_m_per_s"))
                 if chunks[0].HasField(column)]
        reader = states.StateReader(ids, cloths.particles, names, cloths._session.dtype, {})
        for chunk in chunks:
            reader.sink(chunk)
        rows = np.array([cloths._row_of[cloth] for cloth in ids], np.intp)
        return Frame(rows, reader.step_count, reader.time_s, **reader.arrays, number=chunks[0].frame,
                     dropped=sum(chunk.frames_dropped for chunk in chunks))


class RunBase(_StreamBase):
    """Iterate over it: each `RunReport` says how the run does (drape.v1). It steps as long as it is open: leaving its
    `with` ends it, as does a program that ends. Made by `Cloths.run`, which says what the iteration raises."""

    _method = "Run"

    def _begin(self, hz, max_steps, max_behind_s, report_every_s, expected, ids):
        cloths = self._cloths
        rows = columns.rows_of(ids, cloths.num)
        if rows is not None and not len(rows):
            raise errors.bad_field("ids", "nothing is selected")
        if hz is not None and not isinstance(hz, str) and hz == 0:  # in the protocol: real time
            raise errors.bad_field("hz", "0 is not in [0.001, 1e+06] Hz; None is real time, inf as fast as it can")
        chosen = cloths._all_ids if rows is None else [cloths._all_ids[k] for k in rows]
        cloths._forget_states()
        start = checks.message(
            v1.RunRequest.Start, session=cloths._session.name, cloth_ids=chosen, unpaced=hz == float("inf"),
            steps_hz=0 if hz is None or hz == float("inf") else hz, max_steps=max_steps, max_behind_s=max_behind_s,
            report_interval_s=report_every_s, expected_step=expected)
        return v1.RunRequest(start=start)


class _Blocking:
    """What the streams that wait have in common."""

    def _open_call(self):
        call, self._requests = self._connection.open_stream(self._method, self._cloths._route)
        self._requests.put(self._first)
        return call

    def close(self) -> None:
        """Ends it, at once. May be called again."""
        self._requests.put(None)
        self._call.cancel()

    def _read(self):
        try:
            return self._connection.read(self._call, self._requests)
        except grpc.RpcError as error:
            raise self._connection.error_of(error, self._cloths._route, self._asked) from None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __iter__(self):
        return self


class Frames(_Blocking, FramesBase):
    __doc__ = FramesBase.__doc__

    def __next__(self) -> Frame:
        chunks = [self._read()]
        while not chunks[-1].is_last:
            chunks.append(self._read())
        if self._gives_credit:
            self._requests.put(self._credit)
        return self._frame_of(chunks)


class Run(_Blocking, RunBase):
    __doc__ = RunBase.__doc__

    def __next__(self) -> v1.RunReport:
        return self._read()

    def pause(self) -> None:
        """No step begins until `resume`. A report follows. A run that has ended is left alone, here and by `resume` and
        `stop`: the iteration raises why it ended."""
        self._requests.put(v1.RunRequest(pause=True))

    def resume(self) -> None:
        """Goes on where it paused."""
        self._requests.put(v1.RunRequest(pause=False))

    def stop(self) -> None:
        """Ends the run after the steps under way. The last report follows."""
        self._requests.put(None)
