"""Many steps in one call, with all controls known before."""

from __future__ import annotations

import numpy as np

from . import columns, errors, states

_IN_FLIGHT = 4


def rollout(self, nstep: int, *, steps: int = 1, pins=None, pin_targets=None, colliders=None, collider_positions=None,
            view=states.POSITIONS, out=None, progress: bool = False) -> dict:
    """Steps all cloths `nstep` times through one stream and collects the states.

    steps: of the simulation per row. pins: [k] pinned particles and pin_targets: [n or 1, nstep, k, 3], reached within
    each row; colliders: [k] indices and collider_positions: likewise. view as in `step`. out: arrays of an earlier
    call, to be filled again. progress: show a bar (needs tqdm).
    Returns a dict: "positions" and "velocities" [n, nstep, particles, 3] as asked for, "step_count" and "time_s" [n,
    nstep], "faulted" [n, nstep].
    """
    over_s = _row_s(self, steps)
    moves = []
    for name, elements, targets, control in (("pin_targets", pins, pin_targets, self.move_pins),
                                             ("collider_positions", colliders, collider_positions, self.move_colliders)):
        if (elements is None) != (targets is None):
            raise errors.bad_field(name, "elements and their targets go together")
        if elements is not None:
            rows = columns.shaped(name, targets, (self.num, nstep, len(elements), 3))
            moves.append((control, elements, rows))
    results = {} if out is None else out
    with self.pipeline(_IN_FLIGHT) as stream:
        done = 0
        for answer in _answers(stream, moves, nstep, steps, view, over_s, progress):
            _store(results, answer, done, nstep)
            done += 1
    return results


def _row_s(cloths, steps):
    """Time of a row, so that a target is reached at its end: within one step, or over all of them."""
    if steps == 1:
        return 0.0
    if cloths.spec is not None and cloths.spec.settings.HasField("time_step_s"):
        return steps * cloths.spec.settings.time_step_s
    return steps / 60


def _answers(stream, moves, nstep, steps, view, over_s, progress):
    rows = range(nstep)
    if progress:
        from tqdm.auto import tqdm

        rows = tqdm(rows, unit="step")
    for row in rows:
        for control, elements, targets in moves:
            control(elements, targets[:, row], over_s=over_s)
        answer = stream.step(steps, view=view)
        if answer is not None:
            yield answer
    yield from stream.drain()


def _store(results, answer, row, nstep):
    for name in ("positions", "velocities", "step_count", "time_s", "faulted"):
        value = getattr(answer, name)
        if value is None:
            continue
        shape = (len(value), nstep, *value.shape[1:])
        if name not in results:
            results[name] = np.empty(shape, value.dtype)
        elif results[name].shape != shape or results[name].dtype != value.dtype:
            raise errors.bad_field(f"out[{name}]", f"must be {value.dtype} of shape {shape}, got "
                                                   f"{results[name].dtype} of shape {results[name].shape}")
        results[name][:, row] = value
