"""States of many cloths as numpy arrays."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from . import columns, errors, v1

POSITIONS = v1.StateView(positions=True)
VELOCITIES = v1.StateView(velocities=True)
POSITIONS_AND_VELOCITIES = v1.StateView(positions=True, velocities=True)

_DTYPES = {v1.PackedArray.FLOAT32: np.dtype("<f4"), v1.PackedArray.FLOAT64: np.dtype("<f8"),
           v1.PackedArray.UINT32: np.dtype("<u4")}
_ENCODED = {v1.PackedArray.FLOAT16: np.dtype("<f2"), v1.PackedArray.INT16: np.dtype("<i2")}
_COLUMNS = {"positions": "positions_m", "velocities": "velocities_m_per_s"}
# field of an Answer, of a StateChunk, shape per cloth
_REDUCTIONS = (("coverage", "coverages_m2", ()), ("centroid", "centroids_m", (3,)), ("box", "boxes_m", (2, 3)),
               ("target_distance", "target_distances_m", ()))
PER_STEP = ("positions", "velocities", "origins", *(name for name, _, _ in _REDUCTIONS), "step_count", "time_s", "faulted")


def short(thing):
    """The repr of a dataclass of arrays: their types and shapes, not what is in them."""
    parts = [f"{field.name} {value.dtype}{list(value.shape)}" for field in dataclasses.fields(thing)
             if isinstance(value := getattr(thing, field.name), np.ndarray)]
    return f"<{type(thing).__name__}: {', '.join(parts)}>"


@dataclasses.dataclass(repr=False)
class States:
    """States of m cloths, in the world frame. Arrays are None if they were not asked for.

    rows: [m] indices of the cloths in their batch. step_count: uint64[m] completed steps. time_s: float64[m].
    positions [m], velocities [m/s]: [m, particles, 3], float64 from the backend `reference`, else float32.
    """

    rows: np.ndarray
    step_count: np.ndarray
    time_s: np.ndarray | None = None
    positions: np.ndarray | None = None
    velocities: np.ndarray | None = None

    def __repr__(self):
        steps = sorted({int(step) for step in self.step_count})
        at = f" at step {steps[0]}" if len(steps) == 1 else f" at steps {steps[0]} to {steps[-1]}" if steps else ""
        arrays = [f"{name} {value.dtype}{list(value.shape)}" for name in PER_STEP if name not in ("step_count", "time_s", "faulted")
                  and (value := getattr(self, name, None)) is not None]
        faulted = getattr(self, "faulted", None)
        also = [name for name in ("reports", "grips", "impulses", "contacts") if getattr(self, name, None)]
        count = [] if faulted is None else [f"{int(faulted.sum())} faulted"]
        return f"<{type(self).__name__} of {len(self.rows)} cloths{at}: {', '.join(arrays + also + count)}>"


@dataclasses.dataclass(repr=False)
class Grips:
    """particles: int64[m, grips], what each grip holds, -1 if it is open. positions [m]: [m, grips, 3], where that is,
    in the environment; of an open one 0. impulses [N s]: [m, grips, 3], what the cloth gave to each grip in the last
    step, 0 of an open one; None without `step(impulses=True)`. `forces` makes forces of them.

    grips: the most that one of the cloths has; the slots that a cloth has not are as open ones.
    """

    particles: np.ndarray
    positions: np.ndarray
    impulses: np.ndarray | None = None

    __repr__ = short

    def forces(self, time_step_s: float) -> np.ndarray:
        """[m, grips, 3] [N], with which the cloth pulled each grip on average over the last step. time_step_s: that of
        the cloths, `settings.time_step_s` of what `cloths.describe(0)` tells, by default 1/60. Raises
        FailedPrecondition without `step(impulses=True)`."""
        if self.impulses is None:
            raise errors.FailedPrecondition("forces of grips come with step(impulses=True)", reason="NO_IMPULSES")
        return self.impulses / time_step_s

    @classmethod
    def of(cls, message, ids, has_impulses=False):
        impulses = _by_slot(message, ids, message.impulses_n_s, 0.0, (3,)) if has_impulses else None
        return cls(_by_slot(message, ids, np.array(message.particles, np.int64), -1),
                   _by_slot(message, ids, message.positions_m, 0.0, (3,)), impulses)


@dataclasses.dataclass(repr=False)
class Impulses:
    """What m cloths gave in a step [N s]: an impulse over the time step is the mean force [N].

    colliders: [m, colliders, 3]; angular: [m, colliders, 3], about the pivot of each [N m s]; both are None if the cloths
    have not the same number of them. pins: [m, pins, 3], of the pins `particles`, int64[pins], ascending; both are None
    if the cloths do not hold the same. grips: [m, grips, 3], as of `Grips`. Colliders and pins are NaN of cloths that are
    faulted or had no step to do, unless all are: then there are none, [m, 0, 3].
    """

    colliders: np.ndarray | None
    angular: np.ndarray | None
    pins: np.ndarray | None
    particles: np.ndarray | None
    grips: np.ndarray

    __repr__ = short

    @classmethod
    def of(cls, response, ids):
        of_colliders, of_pins = response.collider_impulses, response.pin_impulses
        rows = _rows_of(of_colliders.cloth_ids, ids)
        colliders, angular = (_by_cloth(rows, values, len(ids))
                              for values in (of_colliders.impulses_n_s, of_colliders.angular_impulses_n_m_s))
        rows = _rows_of(of_pins.cloth_ids, ids)
        pins = _by_cloth(rows, of_pins.impulses_n_s, len(ids))
        particles = np.zeros(0, np.int64) if len(of_pins.particles) == 0 else None
        if particles is None and pins is not None:
            numbers = np.array(of_pins.particles, np.int64).reshape(-1, pins.shape[1])
            particles = numbers[0]
            if (numbers != particles).any():
                pins = particles = None
        of_grips = response.grips
        return cls(colliders, angular, pins, particles, _by_slot(of_grips, ids, of_grips.impulses_n_s, 0.0, (3,)))


@dataclasses.dataclass(repr=False)
class Contacts:
    """What each particle got in a step from each thing that it touched [N s], k rows: an impulse over the time step is the
    mean force [N].

    cloths: int64[k], which of the m cloths of the answer. particles: int64[k]. colliders: int64[k], the index in
    environment.colliders; -1: the cloth itself and others of its world. impulses: float64[k, 3], a push is away from what
    is touched; NaN where the device had no room to tell. By cloth, then particle, then collider, cloth last.
    """

    cloths: np.ndarray
    particles: np.ndarray
    colliders: np.ndarray
    impulses: np.ndarray
    shape: tuple = (0, 0)

    __repr__ = short

    @classmethod
    def of(cls, message, ids, particles):
        return cls(_rows_of(message.cloth_ids, ids), np.array(message.particles, np.int64),
                   np.array(message.colliders, np.int64), np.array(message.impulses_n_s, float).reshape(-1, 3),
                   (len(ids), particles))

    def of_colliders(self):
        """float64[m, particles, 3]: of each particle the sum over all colliders, bodies too."""
        return self._sum(self.colliders >= 0)

    def of_cloth(self):
        """float64[m, particles, 3]: of each particle by the cloth itself and by others of its world."""
        return self._sum(self.colliders < 0)

    def _sum(self, rows):
        result = np.zeros((*self.shape, 3))
        np.add.at(result, (self.cloths[rows], self.particles[rows]), self.impulses[rows])
        return result


def contacts_among(message, ids):
    """The rows of a ContactImpulses that are of the cloths `ids`."""
    rows = np.flatnonzero(np.isin(np.array(message.cloth_ids, np.uint64), np.array(ids, np.uint64)))
    impulses = np.array(message.impulses_n_s, float).reshape(-1, 3)[rows].ravel()
    return v1.ContactImpulses(cloth_ids=[message.cloth_ids[row] for row in rows],
                              particles=[message.particles[row] for row in rows],
                              colliders=[message.colliders[row] for row in rows], impulses_n_s=impulses)


def _rows_of(cloth_ids, ids):
    """The places in `ids` of ids that all are there."""
    ids = np.array(ids, np.uint64)  # larger than a float64 can tell apart
    order = np.argsort(ids)
    return order[np.searchsorted(ids[order], np.array(cloth_ids, np.uint64))]


def _by_slot(message, ids, values, none, width=()):
    """[cloths, grips, *width] of the rows of a GripStates, each at its cloth and slot; `none` where there is no row."""
    slots = np.array(message.slots, np.intp)
    result = np.full((len(ids), slots.max(initial=-1) + 1, *width), none)
    result[_rows_of(message.cloth_ids, ids), slots] = np.array(values).reshape(len(slots), *width)
    return result


def _by_cloth(rows, values, count):
    """[count, k, 3] of rows of `count` cloths, k of each that has any; NaN of the others. None if k differs."""
    present, sizes = np.unique(rows, return_counts=True)
    if not len(present):
        return np.zeros((count, 0, 3))
    if sizes.min() != sizes.max():
        return None
    result = np.full((count, sizes[0], 3), np.nan)
    order = np.argsort(rows, kind="stable")
    result[present] = np.array(values).reshape(-1, 3)[order].reshape(len(present), -1, 3)
    return result


@dataclasses.dataclass(repr=False)
class Answer(States):
    """What a step of m cloths brought. `positions` and `velocities` are read-only: views of the received bytes, above 1 MiB
    arrays made of chunks; every answer has its own, so keeping one is safe.

    With a view of an encoding: FLOAT16 brings float16 arrays, positions in the environments, and origins, float64[m, 3],
    to be added; FIXED16 brings positions as float32 in the world, off by 1/131 068 of the longest side of a cloth's box,
    and velocities as float16. Reductions that the view asks for, float64: coverage [m^2], target_distance [m]: [m];
    centroid [m]: [m, 3]; box [m]: [m, 2, 3], lowest and highest corner; both in the world.

    faulted: bool[m]. reports: m StepReports, grips, impulses and contacts, if asked for. timing: where the server spent its time,
    None if nothing was sent.
    """

    faulted: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(0, bool))
    reports: list = dataclasses.field(default_factory=list)
    timing: Any = None
    grips: Grips | None = None
    impulses: Impulses | None = None
    contacts: Contacts | None = None
    origins: np.ndarray | None = None
    coverage: np.ndarray | None = None
    centroid: np.ndarray | None = None
    box: np.ndarray | None = None
    target_distance: np.ndarray | None = None

    @classmethod
    def of_nothing(cls, view, particles, dtype):
        """Where nothing is selected: what the view asks for, of no cloths."""
        answer = cls(np.empty(0, np.intp), np.empty(0, np.uint64), np.empty(0))
        if view is None:
            return answer
        shape = (0, len(view.particles) or particles, 3)
        dtype, of_velocities = _of_encoding(view.encoding, dtype)
        if view.encoding == v1.StateView.FLOAT16:
            answer.origins = np.empty((0, 3))
        if view.positions or not (view.velocities or view.reductions):  # as the server understands a view
            answer.positions = np.empty(shape, dtype)
        if view.velocities:
            answer.velocities = np.empty(shape, of_velocities)
        for name, _, per_cloth in _REDUCTIONS:
            if v1.StateView.Reduction.Value(name.upper()) in view.reductions:
                setattr(answer, name, np.empty((0, *per_cloth)))
        return answer

    def measure(self, name):
        """A number of every report as an array [m], e.g. `answer.measure("max_strain")`: a field of StepReport, in the
        unit that its name ends with: max_strain, rms_strain, strain_p50, strain_p90, strain_p99, kinetic_energy_j,
        potential_energy_j, strain_energy_j, lowest_m, contacts, max_penetration_m, rms_motion_m, near_pairs, crossings,
        smallest_distance_m, max_residual_m, iterations … (`help(drape.v1.StepReport)` has them all). Raises FailedPrecondition (NO_REPORTS) without `step(report=True)`,
        InvalidArgument if reports have no such number."""
        field = v1.StepReport.DESCRIPTOR.fields_by_name.get(name) if isinstance(name, str) else None
        if field is None or field.message_type is not None or field.cpp_type == field.CPPTYPE_STRING:
            raise errors.bad_field("name", f"{name!r} is not a number of StepReport, as max_strain is")
        if len(self.rows) and not self.reports:
            raise errors.FailedPrecondition("measures come with step(report=True)", reason="NO_REPORTS")
        return np.array([getattr(report, name) for report in self.reports])


def _of_encoding(encoding, dtype):
    """What positions and velocities come as; without an encoding as `dtype`."""
    half = np.dtype(np.float16)
    return {v1.StateView.FLOAT16: (half, half), v1.StateView.FIXED16: (np.dtype(np.float32), half)}.get(encoding, (dtype, dtype))


def view_of(view):
    """None, or a StateView: the constants of this module, or one with `particles`."""
    if view is not None and not isinstance(view, v1.StateView):
        raise errors.bad_field("view", f"None, drape.POSITIONS, ..., or a StateView, got {type(view).__name__}")
    if view is not None and v1.StateView.COVERAGE in view.reductions and not view.coverage_radius_m:
        raise errors.bad_field("view.coverage_radius_m", "the reduction COVERAGE needs it, e.g. StateView(reductions=['COVERAGE'], "
                                                         "coverage_radius_m=0.02): > 0")
    if view is not None and v1.StateView.TARGET_DISTANCE in view.reductions and not view.HasField("target_m"):
        raise errors.bad_field("view.target_m", "the reduction TARGET_DISTANCE needs it, e.g. target_m=drape.pack(target)")
    return view


def unpack(packed):
    """A read-only array over the bytes of a PackedArray, without a copy of them in numpy."""
    dtype = _DTYPES.get(packed.data_type) or _ENCODED[packed.data_type]
    array = np.frombuffer(packed.data, dtype=dtype)
    return array.reshape(tuple(packed.shape))


def pack(array):
    """A PackedArray with a copy of `array`, of any shape: numbers of the type float32, float64 or uint32. Raises
    InvalidArgument for other types, and for lists of unequal lengths."""
    array = np.ascontiguousarray(columns.numbers("array", array))
    for data_type, dtype in _DTYPES.items():
        if array.dtype == dtype:
            return v1.PackedArray(data_type=data_type, shape=array.shape, data=array.tobytes())
    raise errors.bad_field("array", f"float32, float64 or uint32 is needed, got {array.dtype}")


_CLOTHS_AT_ONCE = 64
# Of one number or vector per cloth: what they are called here, their column, their shape.
_PER_CLOTH = (("origins", "origins_m", (3,)), ("position_steps", "position_steps_m", ()), *_REDUCTIONS)


def _decoded(found):
    """The same by the fields of an Answer: positions of the encoding FIXED16 become numbers of metres."""
    if "position_steps" in found:
        steps, origins, numbers = found.pop("position_steps"), found.pop("origins"), found["positions"]
        found["positions"] = np.empty(numbers.shape, np.float32)
        for at in range(0, len(numbers), _CLOTHS_AT_ONCE):  # in double precision, a few at a time
            some = slice(at, at + _CLOTHS_AT_ONCE)
            found["positions"][some] = origins[some, None] + steps[some, None, None] * numbers[some]
    return found


def blocks_of(chunk, ids):
    """Arrays of a chunk that holds the cloths `ids` (a list) whole and of equal size, by the fields of an Answer; and the
    times."""
    found = {}
    for name, column in _COLUMNS.items():
        if chunk.HasField(column):
            rows = unpack(getattr(chunk, column))
            found[name] = rows.reshape(len(ids), -1, 3)
    for name, column, shape in _PER_CLOTH:
        values = getattr(chunk, column)
        if values:
            found[name] = np.array(values).reshape(len(ids), *shape)
    found = _decoded(found)
    if list(chunk.cloth_ids) != ids:
        place = {cloth: k for k, cloth in enumerate(chunk.cloth_ids)}
        order = [place[cloth] for cloth in ids]
        found = {name: array[order] for name, array in found.items()}
        return found, np.array(chunk.times_s)[order]
    return found, np.array(chunk.times_s)


class _Chunks:
    """Collects the chunks of the cloths `ids`, of `particles` rows each, into whole arrays; `sink` takes each chunk."""

    def __init__(self, ids, particles):
        self._place = {cloth: k for k, cloth in enumerate(ids)}
        self._shape = (len(ids), particles, 3)
        self.step_count = np.zeros(len(ids), np.uint64)
        self.time_s = np.zeros(len(ids))
        self.arrays = {}

    def _array(self, name, packed):
        """Where the rows of a column go; None: nowhere."""
        raise NotImplementedError

    def sink(self, chunk):
        places = [self._place[cloth] for cloth in chunk.cloth_ids]
        if not places:
            return
        self.step_count[places] = chunk.steps
        self.time_s[places] = chunk.times_s
        counts, firsts = list(chunk.particle_counts), list(chunk.first_particles)
        first, last = places[0], places[-1]
        for name, column in _COLUMNS.items():
            packed = getattr(chunk, column)
            array = self._array(name, packed) if chunk.HasField(column) else None
            if array is None:
                continue
            rows = unpack(packed)
            whole = counts == [array.shape[1]] * len(counts)
            if whole and places == list(range(first, last + 1)):
                array[first:last + 1] = rows.reshape(len(places), -1, 3)
                continue
            begin = 0
            for k, place in enumerate(places):
                at = firsts[k] if firsts else 0
                array[place, at:at + counts[k]] = rows[begin:begin + counts[k]]
                begin += counts[k]
        self._take_numbers(chunk, places)

    def _take_numbers(self, chunk, places):
        """What is one number or vector of each cloth."""


class StateReader(_Chunks):
    """Collects the chunks of one ReadStates."""

    def __init__(self, ids, particles, names, dtype, out):
        super().__init__(ids, particles)
        shape = self._shape
        for name in out:
            if name not in names:
                raise errors.bad_field("out", f"has {name!r}, but what is read is {' and '.join(names)}")
        for name in names:
            array = out.get(name)
            if array is None:
                array = np.empty(shape, dtype)
            elif not isinstance(array, np.ndarray):
                raise errors.bad_field(f"out[{name}]", f"must be an array, got {type(array).__name__}")
            elif array.shape != shape or array.dtype != dtype or not array.flags.writeable:
                raise errors.bad_field(f"out[{name}]", f"must be a writeable {dtype} array of shape {shape}, got "
                                                       f"{array.dtype} of shape {array.shape}")
            self.arrays[name] = array

    def _array(self, name, packed):
        return self.arrays.get(name)


class StepReader(_Chunks):
    """Joins the messages of one answer to a step in chunks; `take` takes each of them. response: all but the states."""

    def __init__(self, ids, particles):
        super().__init__(ids, particles)
        self.response = None

    def clear(self):
        """The answer comes again, from the beginning."""
        self.response = None

    def take(self, part):
        """False: that was the last one."""
        if part.HasField("states"):
            self.sink(part.states)
            part.ClearField("states")
        if self.response is None:
            self.response = part
        else:
            self.response.MergeFrom(part)
        return part.continues

    def blocks(self):
        """The arrays by the fields of an Answer, read-only, and the times."""
        found = _decoded(self.arrays)
        for array in found.values():
            array.flags.writeable = False
        return found, self.time_s

    def _array(self, name, packed):
        if name not in self.arrays:
            dtype = _DTYPES.get(packed.data_type) or _ENCODED[packed.data_type]
            self.arrays[name] = np.empty(self._shape, dtype)
        return self.arrays[name]

    def _take_numbers(self, chunk, places):
        for name, column, shape in _PER_CLOTH:
            values = getattr(chunk, column)
            if values:
                if name not in self.arrays:
                    self.arrays[name] = np.empty((self._shape[0], *shape))
                self.arrays[name][places] = np.array(values).reshape(len(places), *shape)
