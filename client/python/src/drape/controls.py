"""What acts on cloths from their next step on."""

from __future__ import annotations

import functools

import numpy as np

from . import checks, columns, errors, retries, v1

_GRIP_COLUMNS = {"particles": 0, "radii_m": 0.0, "over_s": 0.0, "largest_forces_n": 0.0}


class Controls:
    """Part of `Cloths`: controls go with the next step of their cloths, once. Arguments that do not fit are an
    InvalidArgument at once; what the server refuses comes with the step."""

    num: int
    ids: np.ndarray
    spec: v1.ClothSpec | None

    def move_pins(self, particles, targets, over_s=0.0, ids=None) -> None:
        """Moves pins in a straight line, from the start of the next step on.

        particles: the k pinned particles, [k] or [m, k], each once. targets [m]: [m, k, 3] (or what spreads to it), each in its
        cloth's environment, m the cloths of `ids`. over_s: duration [s], 0 = within one step; a number, [m, 1] or [m, k].
        Raises InvalidArgument; with the step come FailedPrecondition (PIN_NOT_FOUND), InvalidArgument.
        """
        self._control("pin_controls", particles, ids, "particles", {"targets_m": (targets, 3), "over_s": (over_s, 0)})

    def move_colliders(self, colliders, positions, rotations=None, over_s=0.0, ids=None) -> None:
        """Moves colliders (indices in environment.colliders, [k] or [m, k], each once) to poses: their pivots in a straight
        line to positions [m] [m, k, 3], turning the shorter way to rotations [m, k, 4] (quaternions x, y, z, w from the
        orientation in the spec; None: as described). over_s as for `move_pins`. Raises InvalidArgument; with the step come
        FailedPrecondition (COLLIDER_NOT_FOUND), InvalidArgument."""
        if rotations is None:
            rotations = (0.0, 0.0, 0.0, 1.0)
        self._control("collider_controls", colliders, ids, "colliders", {
            "positions_m": (positions, 3), "rotations_xyzw": (rotations, 4), "over_s": (over_s, 0)})

    def set_rest_lengths(self, constraints, lengths, over_s=0.0, ids=None) -> None:
        """Changes the rest lengths [m] of distance constraints linearly to `lengths`, [m, k], each > 0; over_s as for
        `move_pins`. constraints: [k] or [m, k], each once, indices: of `particles`, those of its distance_constraints; of a
        grid, row * (columns - 1) + column is the edge to the next column, (columns - 1) * rows + row * columns + column
        that to the next row; of a mesh, see `help(drape.v1.RestLengthControls)`; `topology()` has them beside its edges.
        Raises InvalidArgument; with the step come FailedPrecondition (CONSTRAINT_NOT_FOUND), InvalidArgument."""
        self._control("rest_length_controls", constraints, ids, "constraints", {
            "lengths_m": (lengths, 0), "over_s": (over_s, 0)})

    def scale_rest_lengths(self, scales, over_s=0.0, ids=None) -> None:
        """Changes all rest lengths to those of the description times `scales`, a number or [m], each 0.001 to 1000, over
        over_s [s], a number or [m]. Raises InvalidArgument; with the step, too."""
        rows = self._rows_or_all(ids)
        self._pending.add("rest_length_scales", rows, {
            "scales": columns.shaped("scales", scales, (len(rows),)),
            "over_s": columns.shaped("over_s", over_s, (len(rows),))})

    def restart(self, ids=None, *, transforms=None, overrides=None, to: str | None = None, of=None) -> None:
        """Starts cloths again with their next step, as `reset` does with these transforms and overrides, but without a
        request of its own. to: they start from what `save` kept by this name, as `load` does with the same `of`; goes
        without transforms and overrides. Forgets what `move_pins`, `grip` and the like asked for before; what they ask for
        after it happens after the start. Cloths that wait for the same step start in one way: from one `to`, or all
        with transforms, or all with overrides, or with neither; so do those of one `session.step`. Raises InvalidArgument; with the
        step come the errors of `reset` and `load`."""
        rows = self._rows_or_all(ids)
        count = len(rows)
        if to is None:
            if of is not None:
                raise errors.bad_field("of", "goes with `to`")
            given = {}
            if transforms is not None:
                given["transforms"] = columns.shaped("transforms", transforms, (count, 7))
            if overrides is not None:
                given["overrides"] = _overrides(overrides, count)
            add = self._pending.add_reset
        else:
            if transforms is not None or overrides is not None:
                raise errors.bad_field("to", "goes without transforms and overrides")
            saved = rows if of is None else columns.spread("of", columns.indices("of", of, self.num), (count,))
            given = {"saved_cloth_ids": self.ids[saved]}
            add = functools.partial(self._pending.add_load, checks.message(v1.StepLoads, name=to).name)
        if count:
            self._pending.drop(rows, self.num)
            add(rows, given)

    def _control(self, table, elements, ids, name, values):
        rows = self._rows_or_all(ids)
        per_cloth = columns.last_length(name, elements)
        shape = (len(rows), per_cloth)
        flat = {name: columns.distinct(name, columns.whole(name, elements, shape)).reshape(-1)}
        for column, (value, width) in values.items():
            if width:
                flat[column] = columns.shaped(column, value, (*shape, width)).reshape(-1, width)
            else:
                flat[column] = columns.shaped(column, value, shape).reshape(-1)
        self._pending.add(table, np.repeat(rows, per_cloth), flat)

    # --- grips

    def grip(self, slots, *, particles=None, nearest_to=None, radius_m=None, at=None, largest_force_n=None,
             ids=None) -> None:
        """Grabs particles from the start of the next step on: they move with the grip until it is released. The spec
        needs `max_grips`. Costs no new model, and cloths that hold different particles are stepped side by side.

        slots: the k grips, [k] or [m, k], each once and below max_grips. Either particles: [k] or [m, k], each once, however
        far away; or
        nearest_to [m]: [m, k, 3] in the environment, within radius_m [m] (a number or [m, k]): the nearest that nothing
        holds; the grip stays open if there is none. `step(grips=True)` tells what they hold, `step(impulses=True)` also
        how hard the cloth pulls (`Answer.grips`). at [m]: [m, k, 3], where the grip of
        `particles` is; None: at the particle. What is grabbed keeps its offset from the grip. largest_force_n [N], a
        number or [m, k]: the grip opens at the end of a step over which the cloth pulls it harder on average; None or 0: it
        holds however hard; costs as much as `step(impulses=True)`. Raises InvalidArgument, and what `read` does where it
        asks for the places of particles, for which `drape.aio` wants `await cloths.read()` before; with the step comes
        InvalidArgument for pins, and, of attached cloths, for slots that they have not.
        """
        if (particles is None) == (nearest_to is None) or (nearest_to is None) != (radius_m is None):
            raise errors.bad_field("grip", "give particles, or nearest_to and radius_m")
        rows = self._rows_or_all(ids)
        shape = (len(rows), columns.last_length("slots", slots))
        limits = {} if largest_force_n is None else {"largest_forces_n": largest_force_n}
        if particles is None:
            if at is not None:
                raise errors.bad_field("at", "goes with particles; of nearest_to the grip is there")
            self._grips("GRAB_NEAREST", slots, rows, shape, places=nearest_to, radii_m=radius_m, **limits)
            return
        grabbed = columns.distinct("particles", columns.whole("particles", particles, shape))  # one grip holds a particle
        if at is None:
            if grabbed.size and grabbed.max() >= self.particles:
                raise errors.bad_field("particles", f"{grabbed.max()} is not below {self.particles}")
            try:
                places = self.positions
            except errors.FailedPrecondition as error:
                if error.reason == "NOT_READ":  # of drape.aio
                    error.message = f"grip without `at` needs the places of the particles; {error.message}"
                raise
            at = places[rows[:, None], grabbed] - self._origins_of(rows)[:, None]
        self._grips("GRAB_PARTICLE", slots, rows, shape, places=at, particles=grabbed, **limits)

    def move_grips(self, slots, targets, over_s=0.0, ids=None) -> None:
        """Moves grips in a straight line to targets [m] [m, k, 3], each in its cloth's environment; slots and over_s as
        for `grip` and `move_pins`. No effect on open ones. Raises InvalidArgument; with the step, too."""
        rows = self._rows_or_all(ids)
        shape = (len(rows), columns.last_length("slots", slots))
        self._grips("HOLD", slots, rows, shape, places=targets, over_s=over_s)

    def release(self, slots, ids=None) -> None:
        """Opens grips; what they held keeps its velocity. slots as for `grip`. Raises InvalidArgument; with the step,
        too."""
        rows = self._rows_or_all(ids)
        shape = (len(rows), columns.last_length("slots", slots))
        self._grips("RELEASE", slots, rows, shape, places=0.0)

    def _grips(self, action, slots, rows, shape, places, **values):
        flat = {"slots": self._slots_of("slots", slots, shape).reshape(-1),
                "actions": np.full(shape, v1.GripControls.Action.Value(action)).reshape(-1),
                "targets_m": columns.shaped("targets_m", places, (*shape, 3)).reshape(-1, 3)}
        for name, none in _GRIP_COLUMNS.items():
            spread = columns.whole if name == "particles" else columns.shaped
            flat[name] = spread(name, values.get(name, none), shape).reshape(-1)
        self._pending.add("grip_controls", np.repeat(rows, shape[1]), flat)

    def _slots_of(self, name, slots, shape):
        """`slots` as indices of grips that the cloths have; of attached ones without a spec the server knows."""
        indices = columns.distinct(name, columns.whole(name, slots, shape))
        if self.spec is not None and indices.size and indices.max() >= self.spec.max_grips:
            raise errors.bad_field(name, f"{indices.max()} is not below max_grips of the cloths, {self.spec.max_grips}: give "
                                         "their ClothSpec a larger one (max_grips=…, at most 16)")
        return indices

    def _put_back(self, taken, error):
        """The controls of a step that failed by `error` wait again, if nothing was done and they are not what is wrong."""
        if errors.leaves(error, retries.APPLIED):
            self._pending.put_back(taken)

    def _origins_of(self, rows):
        return np.zeros((len(rows), 3)) if self.origins is None else self.origins[rows]


def _overrides(overrides, count):
    """[count] ClothOverrides as an array."""
    message = checks.message(v1.StepResets, overrides=overrides)
    if len(message.overrides) != count:
        raise errors.bad_field("overrides", f"has {len(message.overrides)} elements, {count} are needed")
    array = np.empty(count, object)
    array[:] = list(message.overrides)
    return array
