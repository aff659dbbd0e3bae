"""A batch of cloths of one description, stepped together."""

from __future__ import annotations

from typing import Any

import numpy as np
from google.protobuf.field_mask_pb2 import FieldMask

from . import checks, columns, errors, masks, states, topology, v1
from .controls import Controls
from .operations import Operation, Reading, Unary, blocking
from .pictures import Pictures
from .pipeline import Pipeline
from .rollout import rollout
from .saved_states import SavedStates
from .streams import Frames, Run

# Larger states come in chunks of 1 MiB into one array: a single message of 12 MB takes longer (`./run bench python`).
_CHUNKS_ABOVE_BYTES = 1 << 20
_VECTORS = ("gravity_m_per_s2", "wind_m_per_s")


def overrides_of(count, **fields):
    """`count` ClothOverrides with these fields, each None, a vector [3] or [count, 3], or a number or [count]."""
    overrides = [v1.ClothOverride() for _ in range(count)]
    for name, values in fields.items():
        if values is None:
            continue
        if name in _VECTORS:
            for override, vector in zip(overrides, columns.shaped(name, values, (count, 3)).tolist()):
                getattr(override, name).extend(vector)
        else:
            for override, value in zip(overrides, columns.shaped(name, values, (count,)).tolist()):
                setattr(override, name, value)
    return overrides


class ClothsBase(Controls, Pictures, SavedStates):
    """n cloths of one spec. `ids` of a method: None (all n), indices, a slice, or a mask bool[n]; nothing selected
    does nothing, and answers have no rows. What is one thing of all cloths, a picture, a snapshot or a run, needs one at least.

    Not for several threads at once. Made by `Session.create` and `Session.attach`.

    ids: uint64[n], the names in the protocol. num: n. particles: rows of each cloth. shape: what the server built.
    spec: the description, with what `update` has changed of all cloths; None if attached. origins: [n, 3] of the
    environments; None: all 0. step_count: uint64[n] completed steps. faulted: bool[n], stopped at the last good state
    until it is reset. timing: where the server spent the last step.

    Whatever asks the server may also raise Unavailable, DeadlineExceeded, SessionLost and StateLost.
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
        if checks.of_kind("spec", spec, v1.ClothSpec) is not None:
            self.spec = v1.ClothSpec()
            self.spec.CopyFrom(spec)
        self.step_count = np.zeros(self.num, np.uint64)
        self.faulted = np.zeros(self.num, bool)
        self.timing = None
        self._pending = columns.Pending()
        self._faulted_when_saved = {}
        self._forget_states()

    def __len__(self):
        return self.num

    def __repr__(self):
        return f"<{self.num} cloths of {self.particles} particles, {int(self.faulted.sum())} faulted>"

    # --- requests

    def _step(self, steps: int = 1, *, view=states.POSITIONS, report: bool = False, grips: bool = False,
              impulses: bool = False, contacts: bool = False, ids=None,
              until: int | None = None, expected: int | None = None, timeout_s: float | None = None,
              request_id: str = "") -> Operation[states.Answer]:
        """Steps the cloths of `ids` and waits. What `move_pins`, `grip` and the other controls asked for takes effect at
        the beginning of that step, once. A step that fails uses them up, unless nothing was done (QUEUE_FULL,
        STEP_MISMATCH, no connection) and they are not what is wrong: then they wait for the next step.

        steps: >= 1, at most `client.info.limits.max_steps_per_request`. until: step until this many are complete
        instead. expected: every cloth must have completed exactly this many, else FailedPrecondition (STEP_MISMATCH).
        view: what the answer brings: drape.POSITIONS (default), VELOCITIES, POSITIONS_AND_VELOCITIES, None, or a
        StateView with `particles`, an `encoding` or `reductions`, e.g. StateView(reductions=["COVERAGE"],
        coverage_radius_m=0.02) for `answer.coverage`, or StateView(reductions=["TARGET_DISTANCE"],
        target_m=drape.pack(target)). report: measure each cloth after the last step (`Answer.measure`). grips: tell
        what the grips hold, and where (`Answer.grips`). impulses: tell what the cloths gave to their colliders, pins
        and grips in the last step (`Answer.impulses`, `Answer.grips.forces`). contacts: tell what each particle got from
        each collider and from cloth in the last step (`Answer.contacts`); wakes a cloth that sleeps, once. request_id: a repetition of a completed
        step with the same id gets the same answer and no step.
        Raises InvalidArgument, FailedPrecondition, NotFound (CLOTH_NOT_FOUND), SessionLost, ResourceExhausted,
        DeadlineExceeded.
        """
        rows = columns.rows_of(ids, self.num)
        wanted = states.view_of(view)
        if rows is not None and not len(rows):
            return self._nothing(wanted)
        request, taken = self._step_request(steps, wanted, report, rows, until, expected, request_id=request_id,
                                            grip_states=grips or impulses, impulses=impulses, contact_impulses=contacts)
        self._forget_states()  # also if the step fails: it may be done in part
        reader = self._reader_of(wanted, rows, contacts)
        try:
            if reader is None:
                response = yield Unary("Step", request, self._route, timeout_s)
            else:
                yield Reading("StepInChunks", request, self._route, reader.take, timeout_s, clear=reader.clear)
                response = reader.response
        except errors.Error as error:
            self._put_back(taken, error)
            if error.reason == "WORLD_INCOMPLETE":
                error.message += "; session.step steps batches of one world"
            raise
        return self._take(response, rows, request, reader)

    def _read(self, positions: bool = True, velocities: bool = False, particles=None, ids=None, out=None,
              timeout_s: float | None = None) -> Operation[states.States]:
        """The present states of the cloths of `ids`, without a step.

        particles: strictly ascending indices, at most 4096; None: all. out: a writeable array for the positions (for the
        velocities, if they alone are read), or a dict of arrays by "positions" and "velocities", to be filled and
        returned. Large answers come in chunks of 1 MiB. Raises InvalidArgument, also if `out` does not fit or has what is
        not read; ResourceExhausted (TOO_MANY_READS), NotFound (CLOTH_NOT_FOUND).
        """
        rows = columns.rows_of(ids, self.num)
        names = [name for name, is_wanted in (("positions", positions), ("velocities", velocities)) if is_wanted]
        if not names:
            raise errors.bad_field("positions", "ask for positions, velocities or both")
        wanted = checks.message(v1.StateView, positions=positions, velocities=velocities, particles=particles)
        if particles is not None and not wanted.particles:
            raise errors.bad_field("particles", "none is named; None means all")
        if rows is not None and not len(rows):
            return self._nothing(wanted)
        request = v1.ReadStatesRequest(session=self._session.name, view=wanted)
        ids_list = self._ids_list(rows)
        columns.fill(request, {"cloth_ids": ids_list})
        given = out if isinstance(out, dict) else {} if out is None else {names[0]: out}
        per_cloth = self.particles if particles is None else len(request.view.particles)
        reader = states.StateReader(ids_list, per_cloth, names, self._session.dtype, given)
        yield Reading("ReadStates", request, self._route, reader.sink, timeout_s)
        for array in reader.arrays.values():
            array.flags.writeable = out is not None
        read = states.States(self._every(rows), reader.step_count, reader.time_s, **reader.arrays)
        self._remember(read, rows, is_whole=particles is None and out is None)
        return read

    def _reset(self, ids=None, *, transforms=None, overrides=None) -> Operation[None]:
        """Back to the state, step 0, pin targets and time of creation; parameters stay. Opens grips, clears faults, and
        forgets controls that wait.

        transforms [m, 7]: position [m] and quaternion x, y, z, w, where each cloth starts this time. overrides: m
        ClothOverrides, one for each cloth: parameters that it has from now on, as `randomise` sets them, e.g.
        [ClothOverride(damping_per_s=1.0)] * m. Raises InvalidArgument,
        ResourceExhausted, NotFound (CLOTH_NOT_FOUND); nothing has been done then.
        """
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            return
        every = self._every(rows)
        request = checks.message(v1.ResetClothsRequest, session=self._session.name, overrides=overrides)
        columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        if transforms is not None:
            columns.fill(request, {"transforms": columns.shaped("transforms", transforms, (len(every), 7))})
        yield Unary("ResetCloths", request, self._route)
        self.step_count[every] = 0
        self.faulted[every] = False
        self._pending.drop(rows, self.num)
        self._forget_states()

    def _write(self, positions, velocities=None, ids=None, *, frame: str = "WORLD") -> Operation[None]:
        """Puts all particles elsewhere, between two steps. Step and time go on; clears faults.

        positions [m]: [m, particles, 3], float32 or float64. velocities [m/s]: the same; None: at rest. frame: "WORLD"
        (as in answers) or "ENVIRONMENT". Pins and what grips hold go on to their targets in the next step.
        Raises InvalidArgument, also for what is not finite; NotFound (CLOTH_NOT_FOUND).
        """
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            return
        every = self._every(rows)
        request = checks.message(v1.WriteStatesRequest, session=self._session.name, frame=frame)
        columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        for name, values in (("positions_m", positions), ("velocities_m_per_s", velocities)):
            if values is not None:
                values = columns.numbers(name, values)
                dtype = np.float32 if values.dtype == np.float32 else np.float64
                spread = columns.spread(name, values.astype(dtype), (len(every), self.particles, 3))
                getattr(request, name).CopyFrom(states.pack(spread.reshape(-1, 3)))
        yield Unary("WriteStates", request, self._route)
        self.faulted[every] = False
        self._forget_states()

    def _topology(self, row: int = 0) -> Operation[topology.Topology]:
        """Triangles, edges, rest positions and grid of a cloth, as the server has them; also of attached cloths. row: its
        index, 0 to n - 1, from the end if negative. Raises InvalidArgument, NotFound (CLOTH_NOT_FOUND)."""
        at = columns.row_of(row, self.num)
        request = v1.ReadTopologyRequest(session=self._session.name, cloth_id=self._all_ids[at])
        return topology.Topology.of((yield Unary("ReadTopology", request, self._route)))

    def _randomise(self, ids=None, *, gravity=None, wind=None, damping=None, friction_static=None, friction_dynamic=None,
                   restitution=None, thickness=None, air_drag=None, air_lift=None) -> Operation[None]:
        """Changes parameters, each cloth's to its own. What is None stays. No new model is built.

        gravity [m/s^2], wind [m/s]: [3] or [m, 3]. The others are numbers or [m], each >= 0: damping [1/s], the rate at
        which velocities decay; friction_static, friction_dynamic, and restitution, at most 1: without units; thickness
        [m]; air_drag and air_lift: coefficients without units. Raises InvalidArgument with the range of the field,
        NotFound (CLOTH_NOT_FOUND); nothing has been changed then.
        """
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            return
        request = v1.UpdateClothsRequest(session=self._session.name, overrides=overrides_of(
            len(self._every(rows)), gravity_m_per_s2=gravity, wind_m_per_s=wind, damping_per_s=damping,
            friction_static=friction_static, friction_dynamic=friction_dynamic, restitution=restitution,
            thickness_m=thickness, air_drag=air_drag, air_lift=air_lift))
        columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        yield Unary("UpdateCloths", request, self._route)

    def _update(self, spec: v1.ClothSpec, paths, ids=None) -> Operation[None]:
        """Sets the fields named by `paths` (see UpdateClothsRequest.update_mask) from `spec`, for all cloths or none:
        `cloths.update(ClothSpec(environment=Environment(wind_m_per_s=[2, 0, 0])), ["environment.wind_m_per_s"])`.
        Raises InvalidArgument, ResourceExhausted (BUILD_QUEUE_FULL, BUILD_TIME_EXCEEDED), Aborted (UPDATE_CONFLICT),
        NotFound (CLOTH_NOT_FOUND); nothing has been changed then."""
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            return
        mask = checks.message(FieldMask, paths=[paths] if isinstance(paths, str) else paths)
        request = checks.message(v1.UpdateClothsRequest, session=self._session.name, spec=spec, update_mask=mask)
        columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        response = yield Unary("UpdateCloths", request, self._route)
        if rows is None:
            self.shape = response.shape
            if self.spec is not None:
                masks.merge(mask.paths, request.spec, self.spec)

    def _describe(self, row: int) -> Operation[v1.Cloth]:
        """Everything that the server tells about one cloth: settings, pins, poses of colliders, the reason of a
        fault. row: as of `topology`. Raises InvalidArgument, NotFound (CLOTH_NOT_FOUND)."""
        at = columns.row_of(row, self.num)
        request = v1.GetClothRequest(session=self._session.name, cloth_id=self._all_ids[at])
        return (yield Unary("GetCloth", request, self._route))

    def _descriptions(self, ids=None) -> Operation[list[v1.Cloth]]:
        """What `describe` tells, of the cloths of `ids`, in few requests. Raises InvalidArgument, NotFound
        (CLOTH_NOT_FOUND)."""
        found = yield from self._session._described(self._ids_list(columns.rows_of(ids, self.num)))
        return list(found.values())

    def _delete(self, ids=None) -> Operation[None]:
        """Deletes the cloths of `ids` on the server. The others of the batch move up: its rows are theirs then, in their
        order. A batch that is deleted as a whole stays as it is, and the server knows no cloth of it. End pipelines,
        frames and runs of the batch before. Raises InvalidArgument, NotFound (CLOTH_NOT_FOUND); nothing has been deleted
        then."""
        rows = columns.rows_of(ids, self.num)
        if rows is not None and not len(rows):
            return
        request = v1.DeleteClothsRequest(session=self._session.name)
        columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        yield Unary("DeleteCloths", request, self._route)
        if rows is not None and len(rows) < self.num:
            self._keep(rows)

    # --- parts

    def _keep(self, deleted):
        """The batch without these rows."""
        kept = np.delete(np.arange(self.num), deleted)
        self._pending.drop(deleted, self.num)
        self._pending.renumber(kept, self.num)
        self._faulted_when_saved = {name: faulted[kept] for name, faulted in self._faulted_when_saved.items()}
        self._name(self.ids[kept])
        self.num = len(kept)
        self.origins = None if self.origins is None else self.origins[kept]
        self.step_count, self.faulted = self.step_count[kept], self.faulted[kept]
        self._forget_states()

    def _name(self, ids):
        self.ids = np.array(ids, dtype=np.uint64)
        self.ids.flags.writeable = False
        self._all_ids = self.ids.tolist()
        self._row_of = {cloth: row for row, cloth in enumerate(self._all_ids)}
        self._all_rows = np.arange(len(self._all_ids))
        self._all_rows.flags.writeable = False
        # What names every cloth in a request to step.
        self._step_all = v1.StepRequest(cloth_ids=self._all_ids).SerializeToString()

    @property
    def _route(self):
        """Of requests about these cloths."""
        return self._session._route._replace(name_of=self._name_of)

    def _name_of(self, cloth):
        row = self._row_of.get(cloth)
        return None if row is None else f"cloth {row} of the batch"

    def _rows_or_all(self, ids):
        return self._every(columns.rows_of(ids, self.num))

    def _every(self, rows):
        return self._all_rows if rows is None else rows

    def _ids_list(self, rows):
        return self._all_ids if rows is None else self.ids[rows].tolist()

    def _nothing(self, view):
        return states.Answer.of_nothing(view, self.particles, self._session.dtype)

    def _reader_of(self, view, rows, has_contacts=False):
        """What joins the messages of an answer with so large states, or with contacts; None: it comes in one message."""
        if has_contacts:
            return states.StepReader(self._ids_list(rows), len(view.particles) or self.particles if view else self.particles)
        if view is None:
            return None
        per_cloth = len(view.particles) or self.particles
        kinds = view.positions + view.velocities or (0 if view.reductions else 1)
        itemsize = 2 if view.encoding else self._session.dtype.itemsize
        count = self.num if rows is None else len(rows)
        if count * per_cloth * 3 * itemsize * kinds <= _CHUNKS_ABOVE_BYTES:
            return None
        return states.StepReader(self._ids_list(rows), per_cloth)

    def _whole_steps(self, steps):
        return checks.whole("steps", steps, 1, 2**32 - 1, told=self._session._most_steps)

    def _step_request(self, steps, view, report, rows, until, expected, **fields):
        extent = {"until_step": until} if until is not None else {"steps": self._whole_steps(steps)}
        request = checks.message(v1.StepRequest, session=self._session.name, report=report, view=view,
                                 expected_step=expected, **extent, **fields)
        if rows is None:
            request.MergeFromString(self._step_all)
        else:
            columns.fill(request, {"cloth_ids": self._ids_list(rows)})
        taken = self._pending.take(request, self.ids, rows, self.num)
        try:
            columns.check_alike(taken)
        except errors.InvalidArgument:
            self._pending.put_back(taken)
            raise
        return request, taken

    def _take(self, response, rows, request, reader=None):
        """The answer to a step; also what the batch knows from it."""
        every = self._every(rows)
        answer = states.Answer(every, np.fromiter(response.steps, np.uint64, len(response.steps)), timing=response.timing,
                               faulted=np.zeros(len(every), bool), reports=list(response.reports))
        self.step_count[every] = answer.step_count
        if response.faulted_cloth_ids or np.count_nonzero(self.faulted):
            self.faulted[every] = False
            self.faulted[[self._row_of[cloth] for cloth in response.faulted_cloth_ids]] = True
            answer.faulted = self.faulted[every]
        self.timing = answer.timing
        if len(every):
            self._connection.told_steps[self._session.name] = int(answer.step_count[answer.step_count.argmax()])
        if request.grip_states:
            answer.grips = states.Grips.of(response.grips, self._ids_list(rows), request.impulses)
        if request.impulses:
            answer.impulses = states.Impulses.of(response, self._ids_list(rows))
        if request.contact_impulses:
            answer.contacts = states.Contacts.of(response.contact_impulses, self._ids_list(rows), self.particles)
        if (reader is not None and request.HasField("view")) or response.HasField("states"):
            arrays, answer.time_s = (states.blocks_of(response.states, self._ids_list(rows)) if reader is None
                                     else reader.blocks())
            for name, array in arrays.items():
                setattr(answer, name, array)
            self._remember(answer, rows, is_whole=not request.view.particles and not request.view.encoding)
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
    descriptions = blocking(ClothsBase._descriptions)
    delete = blocking(ClothsBase._delete)
    write = blocking(ClothsBase._write)
    save = blocking(ClothsBase._save)
    load = blocking(ClothsBase._load)
    drop = blocking(ClothsBase._drop)
    snapshot = blocking(ClothsBase._snapshot)
    topology = blocking(ClothsBase._topology)
    randomise = blocking(ClothsBase._randomise)
    render_png = blocking(ClothsBase._render_png)
    render = blocking(ClothsBase._render)
    render_tiles = blocking(ClothsBase._render_tiles)
    rollout = rollout

    def triangles(self) -> np.ndarray:
        """uint32[triangles, 3] of each cloth: indices of particles, counter-clockwise seen from outside. Raises what
        `topology` does."""
        return self.topology().triangles

    @property
    def positions(self) -> np.ndarray:
        """[n, particles, 3] in the world [m], read-only: what the last step brought, else read now. Raises what `read`
        does, as `velocities` and `time_s` do."""
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
        """float64[n], simulated time [s] of each cloth, like `positions`."""
        if self._time_s is None:
            self.read(particles=[0])
        return self._time_s

    def frames(self, every: int = 1, *, max_hz: float = 0, every_frame: bool = False, velocities: bool = False,
               queue_frames: int = 0, queue_bytes: int = 0) -> Frames:
        """States while somebody steps the cloths: `with cloths.frames() as frames: for frame in frames: ...`. A frame is
        due after each multiple of `every` steps, >= 1, the first one at once.

        max_hz: frames per second at most. every_frame: none is left out; else a later frame replaces one that was not
        read in time. queue_frames, queue_bytes: of every_frame, what may wait to be read (0: 256 frames, 16 MiB). Raises
        ResourceExhausted (SLOW_CONSUMER) where more waits; its metadata `last_step` says up to which step all was read.
        Raises InvalidArgument, ResourceExhausted (TOO_MANY_STREAMS, TOO_MANY_SUBSCRIPTIONS); what the server refuses comes
        with the first frame.
        """
        return Frames(self, every, max_hz, every_frame, velocities, queue_frames, queue_bytes)

    def run(self, hz: float | None = None, *, max_steps: int = 0, max_behind_s: float = 0, report_every_s: float = 0,
            expected: int | None = None, ids=None) -> Run:
        """The server steps the cloths by itself: `with cloths.run() as run: for report in run: ...`. Ends with the `with`.

        hz: steps per second, 0.001 to 1e6; None: real time; inf: as fast as it can. max_steps: ends after so many (0: never).
        max_behind_s [s]: steps later than this are dropped (0: 0.1). report_every_s [s] (0: 1). expected: the steps that
        all of them must have completed, or FailedPrecondition (STEP_MISMATCH). What the batch knows of its states is not
        kept up: `frames` or `read` shows them. Raises InvalidArgument, also if no cloth is named, ResourceExhausted
        (TOO_MANY_STREAMS, TOO_MANY_SUBSCRIPTIONS); what the server refuses comes with the first report.
        """
        return Run(self, hz, max_steps, max_behind_s, report_every_s, expected, ids)

    def pipeline(self, depth: int = 2) -> Pipeline:
        """Steps through one stream with up to `depth` under way, 1 to 16, so that the server never waits for this program.
        Raises InvalidArgument."""
        return Pipeline(self, depth)
