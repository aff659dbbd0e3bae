"""Many steps in one call, with all controls known before."""

from __future__ import annotations

import functools

import numpy as np

from . import checks, columns, errors, extras, states

_IN_FLIGHT = 4
_MOST_ROWS = 2**31 - 1


def rollout(self, nstep: int, *, steps: int = 1, pins=None, pin_targets=None, colliders=None, collider_positions=None,
            view=states.POSITIONS, out=None, progress: bool = False) -> dict:
    """Steps all cloths `nstep` times through one stream and collects the states.

    steps: of the simulation per row. pins: [k] pinned particles and pin_targets: [n or 1, nstep, k, 3], reached within
    each row; colliders: [k] indices and collider_positions: likewise. view as in `step`. out: arrays of an earlier
    call, to be filled again. progress: show a bar (extra `progress`).
    Returns a dict: what the view asks for, e.g. "positions" [n, nstep, particles, 3] or "coverage" [n, nstep] (see
    `Answer`), "step_count", "time_s" and "faulted" [n, nstep].
    """
    moves = self._connection.run(_moves_of(self, nstep, steps, pins, pin_targets, colliders, collider_positions))
    rows = _Rows(nstep, out)
    with self.pipeline(_IN_FLIGHT) as stream:
        for row in _shown(nstep, progress):
            _prepare(moves, row)
            rows.store(stream.step(steps, view=view))
        for answer in stream.drain():
            rows.store(answer)
    return rows.arrays


@functools.wraps(rollout)
async def awaited_rollout(self, nstep, *, steps=1, pins=None, pin_targets=None, colliders=None, collider_positions=None,
                          view=states.POSITIONS, out=None, progress=False):
    moves = await self._connection.run(_moves_of(self, nstep, steps, pins, pin_targets, colliders, collider_positions))
    rows = _Rows(nstep, out)
    async with self.pipeline(_IN_FLIGHT) as stream:
        for row in _shown(nstep, progress):
            _prepare(moves, row)
            rows.store(await stream.step(steps, view=view))
        for answer in await stream.drain():
            rows.store(answer)
    return rows.arrays


def _moves_of(cloths, nstep, steps, pins, pin_targets, colliders, collider_positions):
    """(method, elements, targets [n, nstep, k, 3], times of a row [n, 1]) of every control that is asked for."""
    checks.whole("nstep", nstep, 0, _MOST_ROWS)
    checks.whole("steps", steps, 1, 2**32 - 1)
    moves, over_s = [], None
    for kind, elements, name, targets, control in (
            ("pins", pins, "pin_targets", pin_targets, cloths.move_pins),
            ("colliders", colliders, "collider_positions", collider_positions, cloths.move_colliders)):
        if (elements is None) != (targets is None):
            raise errors.bad_field(name, "elements and their targets go together")
        if elements is not None:
            shape = (cloths.num, nstep, columns.last_length(kind, elements), 3)
            over_s = (yield from _row_s(cloths, steps)) if over_s is None else over_s
            moves.append((control, elements, columns.shaped(name, targets, shape), over_s))
    return moves


def _row_s(cloths, steps):
    """Time of a row, so that a target is reached at its end: within one step, or over all of them. The server knows the
    time steps: whoever attached a batch does not, and others may have changed them."""
    if steps == 1:
        return 0.0
    found = yield from cloths._session._described(cloths._all_ids)
    return steps * np.array([[cloth.settings.time_step_s] for cloth in found.values()])


def _shown(nstep, progress):
    rows = range(nstep)
    if not progress:
        return rows
    extras.need("tqdm", "progress")
    from tqdm.auto import tqdm

    return tqdm(rows, unit="step")


def _prepare(moves, row):
    for control, elements, targets, over_s in moves:
        control(elements, targets[:, row], over_s=over_s)


class _Rows:
    """The answers of a rollout, one row each, in the order in which they come."""

    def __init__(self, nstep, out):
        if not isinstance(out, (dict, type(None))):
            raise errors.bad_field("out", f"the dict of an earlier rollout, or None, got {type(out).__name__}")
        self.arrays = {} if out is None else out
        self._nstep = nstep
        self._done = 0

    def store(self, answer):
        """None, while the stream has none yet, is no row."""
        if answer is None:
            return
        for name in states.PER_STEP:
            value = getattr(answer, name)
            if value is not None:
                self._array(name, value)[:, self._done] = value
        self._done += 1

    def _array(self, name, value):
        shape = (len(value), self._nstep, *value.shape[1:])
        array = self.arrays.get(name)
        if array is None:
            array = self.arrays[name] = np.empty(shape, value.dtype)
        elif array.shape != shape or array.dtype != value.dtype:
            raise errors.bad_field(f"out[{name}]", f"must be {value.dtype} of shape {shape}, got "
                                                   f"{array.dtype} of shape {array.shape}")
        return array
