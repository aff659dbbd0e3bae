"""A batch of cloths of one description, stepped together."""

from __future__ import annotations

import numpy as np

from . import columns, errors, pictures, states, topology, v1
from .operations import Operation, Reading, Unary, blocking
from .pipeline import Pipeline
from .rollout import rollout

# Larger answers are read as a stream of chunks of 1 MiB into one array: a single message of 12 MB takes twice the time.
_STREAM_ABOVE_BYTES = 2 << 20


class ClothsBase:
    """n cloths of one spec. `ids` of every method: None (all n), indices, or a mask bool[n]; nothing selected does nothing.

    Not for several threads at once. Made by `Session.create` and `Session.attach`.

    ids: uint64[n], the names in the protocol. num: n. particles: rows of each cloth. shape: what the server built.
    spec: a copy of the description, origins: [n, 3] of the environments (None: all 0); both None if attached. step_count: uint64[n] completed steps. faulted: bool[n], stopped at the
    last good state until it is reset. timing: where the server spent the last step.
    """

    def __init__(self, session, ids, shape, spec, origins=None):
        self._session = session
        self._connection = session._connection
        self._name(ids)
        self.num = len(self._all_ids)
        self.origins = origins
        self.shape = shape
        self.particles = shape.particles
        self.spec = None
        if spec is not None:
            self.spec = v1.ClothSpec()
            self.spec.CopyFrom(spec)
        self.step_count = np.zeros(self.num, np.uint64)
        self.faulted = np.zeros(self.num, bool)
        self.timing = None
        self._pending = columns.Pending()
        self._forget_states()

    def __len__(self):
        return self.num

    def __repr__(self):
        return f"<{self.num} cloths of {self.particles} particles, {int(self.faulted.sum())} faulted>"

    def triangles(self) -> np.ndarray:
        """uint32[triangles, 3] of each cloth: indices of particles, counter-clockwise seen from outside."""
        if self.spec is None:
            raise errors.Unimplemented("the triangles of attached cloths: give attach() their spec", reason="NO_TOPOLOGY")
        return topology.triangles_of(self.spec)

    # --- controls: they go with the next step of their cloths

    def move_pins(self, particles, targets, over_s=0.0, ids=None) -> None:
        """Moves pins in a straight line, from the start of the next step on.

        particles: the k pinned particles, [k] or [m, k]. targets [m]: [m, k, 3] (or what spreads to it), each in its cloth's
        environment, m the cloths of `ids`. over_s: duration, 0 = within one step; a number, [m, 1] or [m, k].
        Errors come with the step: PIN_NOT_FOUND, INVALID_FIELDS.
        """
        self._control("pin_controls", particles, ids, "particles", {"targets_m": (targets, 3), "over_s": (over_s, 0)})

    def move_colliders(self, colliders, positions, rotations=None, over_s=0.0, ids=None) -> None:
        """Moves colliders (indices in environment.colliders, [k] or [m, k]) to poses: their pivots in a straight line to
        positions [m] [m, k, 3], turning the shorter way to rotations [m, k, 4] (quaternions x, y, z, w from the orientation
        in the spec; None: as described). over_s as for `move_pins`."""
        if rotations is None:
            rotations = (0.0, 0.0, 0.0, 1.0)
        self._control("collider_controls", colliders, ids, "colliders", {
            "positions_m": (positions, 3), "rotations_xyzw": (rotations, 4), "over_s": (over_s, 0)})

    def set_rest_lengths(self, constraints, lengths, over_s=0.0, ids=None) -> None:
        """Changes the rest lengths [m] of distance constraints (indices as in RestLengthControls, [k] or [m, k]) linearly
        to `lengths`, [m, k]."""
        self._control("rest_length_controls", constraints, ids, "constraints", {
            "lengths_m": (lengths, 0), "over_s": (over_s, 0)})

    def scale_rest_lengths(self, scales, over_s=0.0, ids=None) -> None:
        """Changes all rest lengths to those of the description times `scales`, a number or [m], each 0.001 to 1000."""
        rows = self._rows_or_all(ids)
        self._pending.add("rest_length_scales", rows, {
            "scales": columns.shaped("scales", scales, (len(rows),)),
            "over_s": columns.shaped("over_s", over_s, (len(rows),))})

    def _control(self, table, elements, ids, name, values):
        rows = self._rows_or_all(ids)
        per_cloth = np.shape(elements)[-1] if np.ndim(elements) else 1
        shape = (len(rows), per_cloth)
        flat = {name: columns.whole(name, elements, shape).reshape(-1)}
        for column, (value, width) in values.items():
            if width:
                flat[column] = columns.shaped(column, value, (*shape, width)).reshape(-1, width)
            else:
                flat[column] = columns.shaped(column, value, shape).reshape(-1)
        self._pending.add(table, np.repeat(rows, per_cloth), flat)

    # --- requests

    def _step(self, steps: int = 1, *, view=states.POSITIONS, report: bool = False, ids=None, until: int | None = None,
              expected: int | None = None, timeout_s: float | None = None, request_id: str = "") -> Operation[states.Answer]:
        """Steps the cloths of `ids` and waits. Controls that wait for them take effect first, once.

        steps: >= 1. until: step until this many are complete instead. expected: every cloth must have completed exactly this
        many, else FailedPrecondition (STEP_MISMATCH). view: what the answer brings: drape.POSITIONS (default), VELOCITIES,
        POSITIONS_AND_VELOCITIES, None, or a StateView with `particles`. report: measure each cloth after the last step.
        request_id: a repetition of a completed step with the same id gets the same answer and no step.
        Raises InvalidArgument, FailedPrecondition, SessionLost, ResourceExhausted, DeadlineExceeded.
        """
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            return self._nothing()
        wanted = states.view_of(view)
        streams = wanted is not None and self._answer_bytes(wanted, rows) > _STREAM_ABOVE_BYTES
        request = self._step_request(steps, None if streams else wanted, report, rows, until, expected)
        request.request_id = request_id
        self._forget_states()  # also if the step fails: it may be done in part
        response = yield Unary("Step", request, self._session.name, timeout_s)
        answer = self._take(response, rows, request)
        if streams:
            read = yield from self._read(wanted.positions or not wanted.velocities, wanted.velocities,
                                         wanted.particles or None, ids, timeout_s=timeout_s)
            if not np.array_equal(read.step_count, answer.step_count):
                raise errors.Aborted("somebody else has stepped these cloths meanwhile", reason="STATE_MOVED")
            answer.time_s, answer.positions, answer.velocities = read.time_s, read.positions, read.velocities
        return answer

    def _read(self, positions: bool = True, velocities: bool = False, particles=None, ids=None, out=None,
              timeout_s: float | None = None) -> Operation[states.States]:
        """The present states of the cloths of `ids`, without a step.

        particles: strictly ascending indices, at most 4096; None: all. out: a writeable array for the positions, or a dict
        with "positions" and "velocities", to be filled and returned. Large answers come in chunks of 1 MiB.
        """
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            return self._nothing()
        names = [name for name, is_wanted in (("positions", positions), ("velocities", velocities)) if is_wanted]
        if not names:
            raise errors.bad_field("positions", "ask for positions, velocities or both")
        request = v1.ReadStatesRequest(session=self._session.name, view=v1.StateView(
            positions=positions, velocities=velocities, particles=particles))
        ids_list = self._ids_list(rows)
        columns.fill(request, {"cloth_ids": ids_list})
        given = out if isinstance(out, dict) else {"positions": out}
        per_cloth = self.particles if particles is None else len(request.view.particles)
        reader = states.StateReader(ids_list, per_cloth, names, self._session.dtype, given)
        yield Reading("ReadStates", request, self._session.name, reader.sink, timeout_s)
        for array in reader.arrays.values():
            array.flags.writeable = out is not None
        read = states.States(self._every(rows), reader.step_count, reader.time_s, **reader.arrays)
        self._remember(read, rows, is_whole=particles is None and out is None)
        return read

    def _reset(self, ids=None, *, transforms=None, overrides=None) -> Operation[None]:
        """Back to the state, step 0, pin targets and time of creation; parameters stay. Clears faults, and forgets controls
        that wait.

        transforms [m, 7] (position [m] and quaternion x, y, z, w in the place of spec.transform) and overrides (m
        ClothOverrides): the cloths start anew with these, and with all parameters of the spec; `ids` of the batch change.
        """
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            return
        if transforms is not None or overrides is not None:
            yield from self._replace(self._every(rows), transforms, overrides)
        else:
            request = v1.ResetClothsRequest(session=self._session.name)
            columns.fill(request, {"cloth_ids": self._ids_list(rows)})
            yield Unary("ResetCloths", request, self._session.name)
        every = self._every(rows)
        self.step_count[every] = 0
        self.faulted[every] = False
        self._pending.drop(rows, self.num)
        self._forget_states()

    def _replace(self, rows, transforms, overrides) -> Operation[None]:
        """New cloths in the place of `rows`. The old ones go last: if the server refuses, nothing has changed."""
        if self.spec is None:
            raise errors.Unimplemented("resetting attached cloths to transforms: give attach() their spec",
                                       reason="NO_SPEC")
        request = v1.CreateClothsRequest(session=self._session.name, spec=self.spec, count=len(rows), overrides=overrides)
        if self.origins is not None:
            columns.fill(request, {"environment_origins_m": self.origins[rows]})
        if transforms is not None:
            columns.fill(request, {"transforms": columns.shaped("transforms", transforms, (len(rows), 7))})
        response = yield Unary("CreateCloths", request, self._session.name)
        old = v1.DeleteClothsRequest(session=self._session.name)
        columns.fill(old, {"cloth_ids": self.ids[rows]})
        ids = self.ids.copy()
        ids[rows] = response.cloth_ids
        self._name(ids)
        yield Unary("DeleteCloths", old, self._session.name)

    def _update(self, spec: v1.ClothSpec, paths, ids=None) -> Operation[None]:
        """Sets the fields named by `paths` (see UpdateClothsRequest.update_mask) from `spec`, for all cloths or none:
        `cloths.update(ClothSpec(environment=Environment(wind_m_per_s=[2, 0, 0])), ["environment.wind_m_per_s"])`."""
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            return
        request = v1.UpdateClothsRequest(session=self._session.name, spec=spec)
        request.update_mask.paths.extend([paths] if isinstance(paths, str) else paths)
        columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        response = yield Unary("UpdateCloths", request, self._session.name)
        if rows is None:
            self.shape = response.shape

    def _describe(self, row: int) -> Operation[v1.Cloth]:
        """Everything that the server tells about one cloth: settings, pins, poses of colliders, the reason of a fault."""
        at = columns.rows_of([row], self.num)[0]
        request = v1.GetClothRequest(session=self._session.name, cloth_id=self._all_ids[at])
        return (yield Unary("GetCloth", request, self._session.name))

    def _delete(self) -> Operation[None]:
        """Deletes the cloths on the server."""
        request = v1.DeleteClothsRequest(session=self._session.name)
        columns.fill(request, {"cloth_ids": self._all_ids})
        yield Unary("DeleteCloths", request, self._session.name)

    def _render_png(self, width: int = 960, height: int = 720, *, ids=None, timeout_s: float | None = None,
                    **options) -> Operation[bytes]:
        """A PNG file of the cloths as they are. options: further fields of RenderRequest, e.g. `camera=Camera(...)`,
        `colouring=RenderRequest.STRAIN`. Raises FailedPrecondition (NO_EGL_DEVICE) if the server cannot draw."""
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            raise errors.bad_field("ids", "nothing is selected")
        request = v1.RenderRequest(session=self._session.name, width_px=width, height_px=height, **options)
        columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        response = yield Unary("Render", request, self._session.name, timeout_s)
        return response.png

    def _render(self, width: int = 960, height: int = 720, **options) -> Operation[np.ndarray]:
        """The picture of `render_png` as uint8[height, width, 3]. Needs Pillow (pip install drape-sim[render])."""
        png = yield from self._render_png(width, height, **options)
        return pictures.pixels_of(png)

    # --- parts

    def _name(self, ids):
        self.ids = np.array(ids, dtype=np.uint64)
        self.ids.flags.writeable = False
        self._all_ids = self.ids.tolist()
        self._row_of = {cloth: row for row, cloth in enumerate(self._all_ids)}

    def _rows_or_all(self, ids):
        rows = columns.rows_of(ids, self.num)
        return np.arange(self.num) if rows is None else rows

    def _every(self, rows):
        return np.arange(self.num) if rows is None else rows

    def _ids_list(self, rows):
        return self._all_ids if rows is None else self.ids[rows].tolist()

    def _nothing(self):
        return states.Answer(np.empty(0, np.intp), np.empty(0, np.uint64), np.empty(0))

    def _answer_bytes(self, view, rows):
        per_cloth = len(view.particles) or self.particles
        kinds = max(1, view.positions + view.velocities)
        count = self.num if rows is None else len(rows)
        return count * per_cloth * 3 * self._session.dtype.itemsize * kinds

    def _step_request(self, steps, view, report, rows, until, expected):
        request = v1.StepRequest(session=self._session.name, report=report, view=view, expected_step=expected)
        if until is None:
            if steps < 1:
                raise errors.bad_field("steps", f"{steps} is not >= 1")
            request.steps = steps
        else:
            request.until_step = until
        columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        self._pending.take(request, self.ids, rows, self.num)
        return request

    def _take(self, response, rows, request):
        """The answer to a step; also what the batch knows from it."""
        every = self._every(rows)
        answer = states.Answer(every, np.array(response.steps, np.uint64), timing=response.timing,
                               faulted=np.zeros(len(every), bool), reports=list(response.reports))
        self.step_count[every] = answer.step_count
        if response.faulted_cloth_ids or self.faulted.any():
            self.faulted[every] = False
            self.faulted[[self._row_of[cloth] for cloth in response.faulted_cloth_ids]] = True
            answer.faulted = self.faulted[every]
        self.timing = response.timing
        if response.HasField("states"):
            arrays, answer.time_s = states.blocks_of(response.states, self._ids_list(rows))
            answer.positions, answer.velocities = arrays.get("positions"), arrays.get("velocities")
            self._remember(answer, rows, is_whole=not request.view.particles)
        return answer

    def _forget_states(self):
        self._positions = self._velocities = self._time_s = None

    def _remember(self, known, rows, is_whole):
        self.step_count[self._every(rows)] = known.step_count
        if rows is not None:
            return
        self._time_s = known.time_s
        if is_whole:
            self._positions = known.positions if known.positions is not None else self._positions
            self._velocities = known.velocities if known.velocities is not None else self._velocities


class Cloths(ClothsBase):
    __doc__ = ClothsBase.__doc__

    step = blocking(ClothsBase._step)
    read = blocking(ClothsBase._read)
    reset = blocking(ClothsBase._reset)
    update = blocking(ClothsBase._update)
    describe = blocking(ClothsBase._describe)
    delete = blocking(ClothsBase._delete)
    render_png = blocking(ClothsBase._render_png)
    render = blocking(ClothsBase._render)
    rollout = rollout

    @property
    def positions(self) -> np.ndarray:
        """[n, particles, 3] in the world [m], read-only: what the last step brought, else read now."""
        if self._positions is None:
            self.read()
        return self._positions

    @property
    def velocities(self) -> np.ndarray:
        """[n, particles, 3] [m/s], like `positions`."""
        if self._velocities is None:
            self.read(positions=False, velocities=True)
        return self._velocities

    @property
    def time_s(self) -> np.ndarray:
        """float64[n], simulated time of each cloth."""
        if self._time_s is None:
            self.read(particles=[0])
        return self._time_s

    def pipeline(self, depth: int = 2) -> Pipeline:
        """Steps through one stream with up to `depth` under way, so that the server never waits for this program."""
        return Pipeline(self, depth)
