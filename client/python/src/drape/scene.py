"""Scene files: what `drape run` reads, from Python.

    scene = drape.scene.load("client/examples/skirt.json")
    player = scene.play(session)
    player.advance(60)
    player.cloths[0].positions
"""

from __future__ import annotations

import math
import os
import pathlib
import reprlib

import numpy as np
from google.protobuf import json_format

from . import checks, errors, extras, json_check, mesh, scene_check, v1
from .session import Session

_DEFAULT_TIME_STEP_S = 1 / 60
_ROUNDING = 1e-9  # of a step: times of controls are multiples of the step only up to rounding
_MESH_FIELDS = ("mesh_file", "scale_m")


class Scene:
    """A checked scene. message: the `drape.v1.Scene`, its meshes read and its time step in every spec. Raises
    InvalidArgument with the path of the bad field."""

    def __init__(self, message):
        scene_check.check(message)
        self.message = message

    def __repr__(self):
        count = sum(map(scene_check.count_of, self.message.cloths))
        return f"<scene {self.name!r}: {count} cloths, {self.step_count} steps of {self.time_step_s:.4g} s>"

    @property
    def name(self) -> str:
        """What the file calls it, else the name of the file without its ending; "" of a text without a name."""
        return self.message.name

    @property
    def time_step_s(self) -> float:
        """Of all its cloths [s]."""
        return self.message.time_step_s

    @property
    def step_count(self) -> int:
        """Its duration in steps, to the nearest."""
        return math.floor(self.message.duration_s / self.message.time_step_s + 0.5)

    def play(self, session) -> Player:
        """Creates its cloths in `session`, ready for step 0. session: one that waits, no session of `drape.aio`. Raises
        InvalidArgument, what `Session.create` does."""
        return Player(session, self)


def load(path: str | os.PathLike, settings: dict | None = None) -> Scene:
    """Reads a scene file and the meshes that it names. settings: fields of every spec to set, by path, e.g.
    {"settings.substeps": 40}. Raises NotFound, InvalidArgument with the path of the bad field, FailedPrecondition where
    a file cannot be read."""
    path = pathlib.Path(checks.path("path", path))
    if not path.is_file():
        raise errors.NotFound(f"no scene file {path}", reason="NO_SCENE_FILE")
    try:
        scene = parse(path.read_text(encoding="utf-8"), path.parent, settings)
    except OSError as error:
        raise errors.FailedPrecondition(f"{path} cannot be read: {error}", reason="SCENE_FILE_FAILED") from error
    except UnicodeDecodeError as error:
        raise errors.InvalidArgument(f"{path}: {error}", reason="BAD_JSON") from error
    except errors.Error as error:
        error.message = f"{path}: {error.message}"
        raise
    scene.message.name = scene.message.name or path.stem
    return scene


def parse(text: str, folder=".", settings: dict | None = None) -> Scene:
    """The scene of a JSON text; mesh files are relative to `folder`. Raises as `load`."""
    if not isinstance(text, str):
        raise errors.bad_field("text", f"{type(text).__name__} is not a text")
    tree = json_check.parse(text)
    if not isinstance(settings, (dict, type(None))) or any(not isinstance(name, str) for name in settings or ()):
        raise errors.bad_field("settings", f"a dict of fields by path is needed, got {settings!r}")
    if isinstance(tree, dict) and isinstance(tree.get("cloths"), list):
        for k, cloth in enumerate(tree["cloths"]):
            if isinstance(cloth, dict):  # the next check reports it
                _set_all(settings or {}, cloth, f"cloths[{k}].")
    more = {kind: v1.MeshFile.DESCRIPTOR for kind in ("ClothSpec", "Collider")}
    json_check.check(tree, v1.Scene.DESCRIPTOR, more=more)
    tree = json_check.without_nulls(tree or {})
    meshes: list = []
    for k, cloth in enumerate(tree.get("cloths", ())):
        spec, place = cloth.get("spec", {}), f"cloths[{k}].spec"
        _take_mesh(spec, place, "topology", v1.ClothSpec, (k, None), meshes)
        for c, collider in enumerate(spec.get("environment", {}).get("colliders", ())):
            _take_mesh(collider, f"{place}.environment.colliders[{c}]", "shape", v1.Collider, (k, c), meshes)
    message = v1.Scene()
    try:
        json_format.ParseDict(tree, message)
    except json_format.ParseError as error:
        raise errors.InvalidArgument(str(error), reason="BAD_JSON") from error
    _resolve_time_step(message, "settings.time_step_s" in (settings or {}))
    scene = Scene(message)
    for (k, c), place, file, scale_m in meshes:
        spec = message.cloths[k].spec
        owner = spec if c is None else spec.environment.colliders[c]
        owner.mesh.CopyFrom(_read_mesh(pathlib.Path(folder) / file, scale_m, place))
    return scene


def _read_mesh(path, scale_m, place):
    if not 0 < float(scale_m) < math.inf:
        raise errors.bad_field(f"{place}.scale_m", f"must be > 0, got {float(scale_m):g}")
    try:
        return mesh.load(path, float(scale_m))
    except errors.Error as error:
        error.fields = (*error.fields, errors.FieldViolation(f"{place}.mesh_file", error.message))
        error.message = f"{place}.mesh_file: {error.message}"
        raise


def _set_all(settings, cloth, place):
    for field, value in settings.items():
        names = field.split(".")
        owner = _part(cloth, "spec", place)
        at = f"{place}spec."
        for name in names[:-1]:
            owner = _part(owner, name, at)
            at += f"{name}."
        owner[names[-1]] = value


def _part(tree, name, place):
    """The object that `tree` has by this name, an empty one if it has none."""
    if tree.get(name) is None:
        tree[name] = {}
    if not isinstance(tree[name], dict):
        raise errors.bad_field(place + name, f"{reprlib.repr(tree[name])} is not an object")
    return tree[name]


def _take_mesh(owner, place, choice, kind, at, meshes):
    """Takes the fields of MeshFile out of a checked spec or collider, and puts an empty mesh in their place."""
    fields = {name: owner.pop(name) for name in _MESH_FIELDS if name in owner}
    if not fields:
        return
    if "mesh_file" not in fields:
        raise errors.bad_field(f"{place}.scale_m", "needs mesh_file, which is not given")
    for other in kind.DESCRIPTOR.oneofs_by_name[choice].fields:
        if other.name in owner:
            raise errors.bad_field(f"{place}.mesh_file", f"only one of {other.name} and mesh_file may be given")
    owner["mesh"] = {}
    meshes.append((at, place, fields["mesh_file"], fields.get("scale_m", 1.0)))


def _resolve_time_step(message, is_set):
    """One time step for all; a spec may only repeat the scene's."""
    if is_set and message.cloths:
        message.time_step_s = message.cloths[0].spec.settings.time_step_s
    if not message.HasField("time_step_s"):
        message.time_step_s = _DEFAULT_TIME_STEP_S
    for k, cloth in enumerate(message.cloths):
        settings = cloth.spec.settings
        if settings.HasField("time_step_s") and settings.time_step_s != message.time_step_s:
            raise errors.bad_field(f"cloths[{k}].spec.settings.time_step_s",
                                   "differs from time_step_s of the scene, which applies to every cloth")
        settings.time_step_s = message.time_step_s


class Player:
    """The cloths of a scene, stepped with its controls at their times. cloths: one `Cloths` per entry of the scene.
    step: completed steps."""

    def __init__(self, session, scene):
        if not isinstance(session, Session):
            raise errors.bad_field("session", f"{type(session).__module__}.{type(session).__name__} is not a drape.Session, the "
                                              "one that plays scenes (drape.aio has none that does)")
        self.scene = scene
        self.step = 0
        self.cloths = []
        self._session = session
        try:
            for entry in scene.message.cloths:
                count = scene_check.count_of(entry)
                origins = np.zeros((count, 3))
                origins[:, 0] = np.arange(count) * entry.spacing_m
                self.cloths.append(session.create(entry.spec, count, origins=origins, world=entry.world))
        except BaseException:
            for cloths in self.cloths:
                cloths.delete()
            raise
        self._at = [(cloths, row) for cloths in self.cloths for row in range(cloths.num)]

    def __repr__(self):
        return f"<{self.scene!r} at step {self.step}>"

    def advance(self, steps: int | None = None, *, progress: bool = False) -> int:
        """Does `steps` steps (None: to the end of the scene), at most to the end; returns how many. progress: show a
        bar. Raises InvalidArgument, what `Session.step` does."""
        if steps is not None:
            checks.whole("steps", steps, 0, 2**63 - 1)
        end = self.scene.step_count if steps is None else min(self.step + steps, self.scene.step_count)
        begin, bar = self.step, None
        if progress:
            extras.need("tqdm", "progress")
            from tqdm.auto import tqdm

            bar = tqdm(total=end - begin, unit="step")
        while self.step < end:
            self._apply_controls()
            until = min(end, self._next_control())
            if bar is not None:
                until = min(until, self.step + max(1, (end - begin) // 100))
            self._session.step(self.cloths, until - self.step, expected=self.step)
            if bar is not None:
                bar.update(until - self.step)
            self.step = until
        if bar is not None:
            bar.close()
        return self.step - begin

    def reset(self) -> None:
        """Back to step 0; gravity and wind as in the scene. Raises what `Cloths.reset` does."""
        for cloths, entry in zip(self.cloths, self.scene.message.cloths):
            cloths.reset()
            cloths.update(entry.spec, ["environment.gravity_m_per_s2", "environment.wind_m_per_s"])
        self.step = 0

    def _first_step(self, control):
        return max(0, math.ceil(control.time_s / self.scene.time_step_s - _ROUNDING))

    def _next_control(self):
        starts = [self._first_step(control) for control in self.scene.message.controls]
        return min([start for start in starts if start > self.step], default=self.scene.step_count)

    def _apply_controls(self):
        """Of several targets of one element the last in the file counts."""
        grips = []
        tables = {"pin_targets": {}, "collider_targets": {}, "rest_lengths": {}, "rest_length_scale": {}}
        for control in self.scene.message.controls:
            if self._first_step(control) != self.step:
                continue
            self._set_environment(control)
            for at in control.cloths or range(len(self._at)):
                for name, element in (("pin_targets", "particle"), ("collider_targets", "collider"),
                                      ("rest_lengths", "constraint")):
                    for target in getattr(control, name):
                        tables[name][at, getattr(target, element)] = target
                if control.HasField("rest_length_scale"):
                    tables["rest_length_scale"][at, 0] = control.rest_length_scale
                grips += [(at, grip) for grip in control.grips]
        for name, targets in tables.items():
            for (at, element), target in sorted(targets.items(), key=lambda item: item[0]):
                cloths, row = self._at[at]
                self._control(name, cloths, row, element, target)
        for at, grip in grips:
            self._grip(*self._at[at], grip)

    def _control(self, name, cloths, row, element, target):
        if name == "pin_targets":
            cloths.move_pins([element], list(target.target_m), target.over_s, ids=[row])
        elif name == "collider_targets":
            cloths.move_colliders([element], list(target.position_m), list(target.rotation_xyzw) or None, target.over_s,
                                  ids=[row])
        elif name == "rest_lengths":
            cloths.set_rest_lengths([element], target.rest_length_m, target.over_s, ids=[row])
        else:
            cloths.scale_rest_lengths(target.scale, target.over_s, ids=[row])

    def _grip(self, cloths, row, grip):
        actions, slots, place = v1.GripControls, [grip.slot], list(grip.target_m)
        if grip.action == actions.HOLD:
            cloths.move_grips(slots, place, grip.over_s, ids=[row])
        elif grip.action == actions.GRAB_PARTICLE:
            cloths.grip(slots, particles=[grip.particle], at=place, largest_force_n=grip.largest_force_n, ids=[row])
        elif grip.action == actions.GRAB_NEAREST:
            cloths.grip(slots, nearest_to=place, radius_m=grip.radius_m, largest_force_n=grip.largest_force_n, ids=[row])
        elif grip.action == actions.RELEASE:
            cloths.release(slots, ids=[row])
        else:
            raise errors.bad_field("action", f"{grip.action} is no action of a grip")

    def _set_environment(self, control):
        paths = [f"environment.{name}" for name in ("gravity_m_per_s2", "wind_m_per_s") if getattr(control, name)]
        if not paths:
            return
        spec = v1.ClothSpec(environment=v1.Environment(
            gravity_m_per_s2=control.gravity_m_per_s2, wind_m_per_s=control.wind_m_per_s))
        for cloths in self.cloths:
            rows = [row for at in control.cloths or range(len(self._at))
                    for of, row in [self._at[at]] if of is cloths]
            cloths.update(spec, paths, rows)
