"""Many steps in one call, with all controls known before."""

from __future__ import annotations

import contextlib
import functools
import math

import numpy as np

from . import checks, columns, errors, extras, states

_IN_FLIGHT = 4
_MOST_ROWS = 2**31 - 1


def rollout(self, nstep: int, *, steps: int = 1, ids=None, pins=None, pin_targets=None, colliders=None,
            collider_positions=None, grips=None, grip_targets=None, grip_particles=None, constraints=None,
            rest_lengths=None, rest_length_scales=None, restarts=None, restart_transforms=None,
            restart_to: str | None = None, view=states.POSITIONS, out=None, progress: bool = False) -> dict:
    """Steps the m cloths of `ids` `nstep` times, at least once, through one stream and collects the states.

    steps: of the simulation per row. Columns have one entry for each cloth and row, [m or 1, nstep, ...], and what they
    move is there at the end of the row. pins: [k] pinned particles and pin_targets: [m, nstep, k, 3]; colliders: [k]
    indices and collider_positions: likewise. grips: [k] slots, with grip_targets: likewise, or grip_particles, or both.
    grip_particles: [m, nstep, k], the particle that each holds during the row, no two of a cloth the same; -1: none. Where
    that is another one than in the row before, the grip grabs it where it is, as `grip` does; for that the stream waits for
    the rows before. Without grip_particles grips hold what they held. constraints:
    [k] and rest_lengths: [m, nstep, k]; rest_length_scales: [m, nstep]. restarts: bool[m, nstep], which cloths start
    again before the row, as by `restart`, with restart_transforms [m, nstep, 7], or from what `save` kept by the name
    restart_to. view as in `step`. out: arrays of an earlier call, to be filled again.
    progress: show a bar (extra `progress`).
    Returns a dict: what the view asks for, e.g. "positions" [m, nstep, particles, 3] or "coverage" [m, nstep] (see
    `Answer`), "step_count", "time_s" and "faulted" [m, nstep].
    Raises, before the first step, InvalidArgument of columns that do not fit, and ResourceExhausted (NO_MEMORY) where this
    program has no room for the states; else what `step` and `Pipeline.step` do.
    Then `error.rows` has the rows that came before, and `read` tells where the cloths are: up to 4 more may be done.
    """
    plan = _Plan(self, nstep, steps, ids, pins=pins, pin_targets=pin_targets, colliders=colliders,
                 collider_positions=collider_positions, grips=grips, grip_targets=grip_targets,
                 grip_particles=grip_particles, constraints=constraints, rest_lengths=rest_lengths,
                 rest_length_scales=rest_length_scales, restarts=restarts, restart_transforms=restart_transforms,
                 restart_to=restart_to)
    rows = _Rows(nstep, out)
    if plan.is_of_nothing:
        return rows.of_nothing(self._nothing(states.view_of(view)))
    rows.make_room(self._nothing(states.view_of(view)), len(plan.every))
    self._connection.run(plan.begin())
    with rows.told(), self.pipeline(_IN_FLIGHT) as stream:
        for row in _shown(nstep, progress):
            if plan.needs_states(row):
                _store_rest(rows, stream)
            self._connection.run(plan.prepare(row))
            rows.store(stream.step(steps, view=view, ids=plan.rows))
        _store_rest(rows, stream)
    return rows.arrays


def _store_rest(rows, stream):
    for answer in stream._rest():
        rows.store(answer)


@functools.wraps(rollout)
async def awaited_rollout(self, nstep, *, steps=1, ids=None, view=states.POSITIONS, out=None, progress=False, **given):
    plan = _Plan(self, nstep, steps, ids, **given)
    rows = _Rows(nstep, out)
    if plan.is_of_nothing:
        return rows.of_nothing(self._nothing(states.view_of(view)))
    rows.make_room(self._nothing(states.view_of(view)), len(plan.every))
    await self._connection.run(plan.begin())
    with rows.told():
        async with self.pipeline(_IN_FLIGHT) as stream:
            for row in _shown(nstep, progress):
                if plan.needs_states(row):
                    await _store_awaited_rest(rows, stream)
                await self._connection.run(plan.prepare(row))
                rows.store(await stream.step(steps, view=view, ids=plan.rows))
            await _store_awaited_rest(rows, stream)
    return rows.arrays


async def _store_awaited_rest(rows, stream):
    async for answer in stream._rest():
        rows.store(answer)


class _Plan:
    """What the columns of a rollout ask for, row by row. rows: as of `columns.rows_of`; every: their indices. Methods that may ask the server
    are operations."""

    def __init__(self, cloths, nstep, steps, ids, *, pins=None, pin_targets=None, colliders=None, collider_positions=None,
                 grips=None, grip_targets=None, grip_particles=None, constraints=None, rest_lengths=None,
                 rest_length_scales=None, restarts=None, restart_transforms=None, restart_to=None):
        checks.whole("nstep", nstep, 1, _MOST_ROWS)
        self._steps = cloths._whole_steps(steps)
        self._cloths = cloths
        self.rows = columns.rows_of(ids, cloths.num)
        self.every = cloths._every(self.rows)
        self._shape = (len(self.every), nstep)
        self.is_of_nothing = not len(self.every)
        self._over_s = 0.0
        self._moves = []  # (method, elements, values [m, nstep, k, ...])
        for name, elements, of, values, width, control in (
                ("pins", pins, "pin_targets", pin_targets, (3,), cloths.move_pins),
                ("colliders", colliders, "collider_positions", collider_positions, (3,), cloths.move_colliders),
                ("constraints", constraints, "rest_lengths", rest_lengths, (), cloths.set_rest_lengths)):
            _go_together(elements, of, values)
            if elements is not None:
                self._moves.append((control, elements, self._column(of, values, columns.last_length(name, elements), *width)))
        self._scales = None if rest_length_scales is None else self._column("rest_length_scales", rest_length_scales)
        self._take_restarts(restarts, restart_transforms, restart_to)
        self._take_grips(grips, grip_targets, grip_particles)

    def begin(self):
        """Time of a row, [m, 1], so that a target is reached at its end: 0 is within one step. The server knows the time
        steps: whoever attached a batch does not, and others may have changed them."""
        if self._steps == 1 or not (self._moves or self._scales is not None or self._targets is not None):
            return
        found = yield from self._cloths._session._described(self._cloths._ids_list(self.rows))
        self._over_s = self._steps * np.array([[cloth.settings.time_step_s] for cloth in found.values()])

    def needs_states(self, row):
        """Whether all answers have to be there before this row: to know where the particles are that it grabs."""
        return self._grabs is not None and self._grabs[:, row].any()

    def prepare(self, row):
        """Sets the controls of a row."""
        yield from self._restart(row)
        for control, elements, values in self._moves:
            control(elements, values[:, row], over_s=self._over_s, ids=self.rows)
        if self._scales is not None:
            self._cloths.scale_rest_lengths(self._scales[:, row], np.reshape(self._over_s, -1), ids=self.rows)
        yield from self._hold(row)

    # --- parts

    def _column(self, name, values, *shape):
        return columns.shaped(name, values, (*self._shape, *shape))

    def _take_restarts(self, restarts, transforms, to):
        self._restarts, self._to = None, to
        if restarts is None and (transforms is not None or to is not None):
            raise errors.bad_field("restarts", "are needed by restart_transforms and restart_to")
        if transforms is not None and to is not None:
            raise errors.bad_field("restart_to", "goes without restart_transforms")
        if restarts is not None:
            restarts = columns.numbers("restarts", restarts)
            if restarts.dtype != bool:
                raise errors.bad_field("restarts", f"a mask is needed, got {restarts.dtype}")
            self._restarts = columns.spread("restarts", restarts, self._shape)
        self._transforms = None if transforms is None else self._column("restart_transforms", transforms, 7)

    def _take_grips(self, slots, targets, particles):
        self._targets = self._grabs = None
        if (slots is None) != (targets is None and particles is None):
            raise errors.bad_field("grips", "go together with grip_targets or grip_particles")
        if slots is None:
            return
        count = columns.last_length("grips", slots)
        self._slots = self._cloths._slots_of("grips", slots, (count,))
        if targets is not None:
            self._targets = self._column("grip_targets", targets, count, 3)
        if particles is None:
            return
        held = columns.spread("grip_particles", columns.integers("grip_particles", particles), (*self._shape, count))
        if held.size and not -1 <= held.min() <= held.max() < self._cloths.particles:
            raise errors.bad_field("grip_particles", f"-1 to {self._cloths.particles - 1} are legal, got "
                                                     f"{held.min()} to {held.max()}")
        columns.distinct("grip_particles", held)
        is_new = np.ones(held.shape, bool)  # also where nobody knows what they hold
        is_new[:, 1:] = held[:, 1:] != held[:, :-1]
        if self._restarts is not None:
            is_new |= self._restarts[..., None]
        self._held, self._grabs, self._opens = held, is_new & (held >= 0), is_new & (held < 0)

    def _restart(self, row):
        if self._restarts is None:
            return
        chosen = self._restarts[:, row]
        at_once = chosen & self._grabs[:, row].any(-1) if self._grabs is not None else np.zeros_like(chosen)
        given = {} if self._transforms is None else {"transforms": self._transforms[:, row]}
        if at_once.any():  # what they are to grab is where that is after the start
            ids = self.every[at_once]
            yield from (self._cloths._load(self._to, ids) if self._to is not None else self._cloths._reset(
                ids, **{name: values[at_once] for name, values in given.items()}))
        later = chosen & ~at_once
        if later.any():
            self._cloths.restart(self.every[later], to=self._to, **{name: values[later] for name, values in given.items()})

    def _hold(self, row):
        if self._grabs is not None:
            for k, slot in enumerate(self._slots):
                opens = self._opens[:, row, k]
                if opens.any():
                    self._cloths.release([slot], ids=self.every[opens])
            for k, slot in enumerate(self._slots):
                grabs = self._grabs[:, row, k]
                if grabs.any():
                    yield from self._grab(slot, self.every[grabs], self._held[grabs, row, k])
        if self._targets is not None:
            self._cloths.move_grips(self._slots, self._targets[:, row], self._over_s, ids=self.rows)

    def _grab(self, slot, ids, particles):
        if self._cloths._positions is None:
            at = (yield from self._cloths._read(ids=ids)).positions[np.arange(len(ids)), particles]
        else:
            at = self._cloths._positions[ids, particles]
        at = (at - self._cloths._origins_of(ids))[:, None]
        self._cloths.grip([slot], particles=particles[:, None], at=at, ids=ids)


def _go_together(elements, name, values):
    if (elements is None) != (values is None):
        raise errors.bad_field(name, "elements and their targets go together")


def _shown(nstep, progress):
    rows = range(nstep)
    if not progress:
        return rows
    extras.need("tqdm", "progress")
    from tqdm.auto import tqdm

    return tqdm(rows, unit="step")


class _Rows:
    """The answers of a rollout, one row each, in the order in which they come."""

    def __init__(self, nstep, out):
        if not isinstance(out, (dict, type(None))):
            raise errors.bad_field("out", f"the dict of an earlier rollout, or None, got {type(out).__name__}")
        self.arrays = {} if out is None else out
        self._nstep = nstep
        self._done = 0
        self._stored = set()

    def make_room(self, nothing, count):
        """For the large arrays of `count` cloths, before the first step. nothing: the answer of none."""
        for name in ("positions", "velocities"):
            value = getattr(nothing, name)
            if value is not None:
                self._array(name, (count, *value.shape[1:]), value.dtype)

    def store(self, *answers):
        """None, while the stream has none yet, is no row."""
        for answer in answers:
            if answer is None:
                continue
            for name in states.PER_STEP:
                value = getattr(answer, name)
                if value is not None:
                    self._stored.add(name)
                    self._array(name, value.shape, value.dtype)[:, self._done] = value
            self._done += 1

    @contextlib.contextmanager
    def told(self):
        """An error that ends the rollout has the rows that are there."""
        try:
            yield
        except errors.Error as error:
            error.rows = {name: array[:, :self._done] for name, array in self.arrays.items() if name in self._stored}
            error.message += f"; {self._done} of {self._nstep} rows came before"
            raise

    def of_nothing(self, answer):
        """The arrays of no cloths."""
        self.store(*[answer] * self._nstep)
        return self.arrays

    def _array(self, name, per_row, dtype):
        """Of this shape and type of a row."""
        shape = (per_row[0], self._nstep, *per_row[1:])
        array = self.arrays.get(name)
        if array is None:
            try:
                array = self.arrays[name] = np.empty(shape, dtype)
            except (MemoryError, ValueError) as error:  # ValueError: larger than numpy can say
                raise errors.ResourceExhausted(
                    f"{name} of shape {shape}, {math.prod(shape) * dtype.itemsize / 1e9:.3g} GB, do not fit into the memory of "
                    "this program: ask for fewer rows at a time, or for less by a StateView (particles, encoding, "
                    "reductions)", reason="NO_MEMORY") from error
        elif array.shape != shape or array.dtype != dtype:
            raise errors.bad_field(f"out[{name}]", f"must be {dtype} of shape {shape}, got "
                                                   f"{array.dtype} of shape {array.shape}")
        return array
