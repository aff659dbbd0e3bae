"""What must hold of a scene before anything of it is played. The same checks and words as those of `drape run`
(client/src/scenes/scene_check.cpp)."""

from __future__ import annotations

import bisect
import itertools
import math

from . import errors, v1

_MOST_STEPS = 1e12  # beyond, counts and times lose their meaning in double precision
_MOST_CLOTHS = 1_000_000  # more than any server holds; bounds the copies that the client itself makes
_MOST_PARTICLES = 1 << 24  # of one cloth


def count_of(cloth):
    """How many cloths an entry of a scene makes."""
    return cloth.count if cloth.HasField("count") else 1


def check(scene):
    """Raises InvalidArgument with the path of the first field of a `drape.v1.Scene` that is wrong."""
    _positive(scene.time_step_s, "time_step_s")
    _not_negative(scene.duration_s, "duration_s")
    if scene.duration_s / scene.time_step_s > _MOST_STEPS:
        raise errors.bad_field("duration_s", "must be at most 10^12 steps")
    _check_cloths(scene)
    for k, control in enumerate(scene.controls):
        _check_control(scene, control, f"controls[{k}]")


def _finite(value, field):
    if not math.isfinite(value):
        raise errors.bad_field(field, f"must be finite, got {value:g}")


def _not_negative(value, field):
    if not 0 <= value < math.inf:
        raise errors.bad_field(field, f"must be >= 0, got {value:g}")


def _positive(value, field):
    if not 0 < value < math.inf:
        raise errors.bad_field(field, f"must be > 0, got {value:g}")


def _vector(vector, field, *, may_be_empty=False):
    if len(vector) != 3 and not (may_be_empty and not len(vector)):
        raise errors.bad_field(field, f"must have 3 numbers, got {len(vector)}")
    for axis, value in enumerate(vector):
        _finite(value, f"{field}[{axis}]")


def _check_cloths(scene):
    if not scene.cloths:
        raise errors.bad_field("cloths", "must have at least one cloth")
    total = 0
    for k, cloth in enumerate(scene.cloths):
        path = f"cloths[{k}]"
        if count_of(cloth) == 0:
            raise errors.bad_field(f"{path}.count", "must be at least 1, got 0")
        total += count_of(cloth)
        if total > _MOST_CLOTHS:
            raise errors.bad_field(f"{path}.count", f"makes more than {_MOST_CLOTHS} cloths")
        _finite(cloth.spacing_m, f"{path}.spacing_m")
        if cloth.spec.WhichOneof("topology") is None:
            raise errors.bad_field(f"{path}.spec", "must have one of grid, mesh, mesh_file and particles")
        if cloth.spec.grid.columns * cloth.spec.grid.rows > _MOST_PARTICLES:
            raise errors.bad_field(f"{path}.spec.grid", f"makes more than {_MOST_PARTICLES} particles")


def _check_control(scene, control, path):
    _not_negative(control.time_s, f"{path}.time_s")
    _vector(control.gravity_m_per_s2, f"{path}.gravity_m_per_s2", may_be_empty=True)
    _vector(control.wind_m_per_s, f"{path}.wind_m_per_s", may_be_empty=True)
    ends = list(itertools.accumulate(count_of(cloth) for cloth in scene.cloths))
    for i, at in enumerate(control.cloths):
        if at >= ends[-1]:
            raise errors.bad_field(f"{path}.cloths[{i}]", f"must be below the number of cloths, {ends[-1]}, got {at}")
    if control.gravity_m_per_s2 or control.wind_m_per_s:  # which the server is told of each cloth once
        told = set()
        for i, at in enumerate(control.cloths):
            if at in told:
                raise errors.bad_field(f"{path}.cloths[{i}]", f"{at} is given twice")
            told.add(at)
    for i, target in enumerate(control.rest_lengths):
        _positive(target.rest_length_m, f"{path}.rest_lengths[{i}].rest_length_m")
        _not_negative(target.over_s, f"{path}.rest_lengths[{i}].over_s")
    if control.HasField("rest_length_scale"):
        _positive(control.rest_length_scale.scale, f"{path}.rest_length_scale.scale")
        _not_negative(control.rest_length_scale.over_s, f"{path}.rest_length_scale.over_s")
    moved = _controlled(scene, control, ends)
    for i, target in enumerate(control.collider_targets):
        _check_collider_target(moved, target, f"{path}.collider_targets[{i}]")
    for i, target in enumerate(control.grips):
        _check_grip(moved, target, f"{path}.grips[{i}]")
    pinned = [(k, {pin.particle for pin in spec.pins}) for k, spec in moved] if control.pin_targets else ()
    for i, target in enumerate(control.pin_targets):
        _check_pin_target(pinned, target, f"{path}.pin_targets[{i}]")


def _controlled(scene, control, ends):
    """The specs that a control is about, each with its place in scene.cloths."""
    asked, first, found = sorted(control.cloths), 0, []
    for k, (cloth, end) in enumerate(zip(scene.cloths, ends)):
        next_asked = bisect.bisect_left(asked, first)
        if not asked or next_asked < len(asked) and asked[next_asked] < end:
            found.append((k, cloth.spec))
        first = end
    return found


def _check_pin_target(pinned, target, path):
    _vector(target.target_m, f"{path}.target_m")
    _not_negative(target.over_s, f"{path}.over_s")
    for k, particles in pinned:
        if target.particle not in particles:
            raise errors.bad_field(f"{path}.particle", f"particle {target.particle} is not a pin of cloths[{k}]")


def _check_collider_target(moved, target, path):
    _vector(target.position_m, f"{path}.position_m")
    if len(target.rotation_xyzw) not in (0, 4):
        raise errors.bad_field(f"{path}.rotation_xyzw", f"must have 4 numbers or none, got {len(target.rotation_xyzw)}")
    for axis, value in enumerate(target.rotation_xyzw):
        _finite(value, f"{path}.rotation_xyzw[{axis}]")
    _not_negative(target.over_s, f"{path}.over_s")
    for k, spec in moved:
        count = len(spec.environment.colliders)
        if target.collider >= count:
            raise errors.bad_field(f"{path}.collider", f"collider {target.collider} is not one of the {count} of cloths[{k}]")


def _check_grip(moved, target, path):
    kind = v1.GripControls.Action
    if target.action not in kind.values() or not target.action:
        legal = ", ".join(name for name, number in kind.items() if number)
        raise errors.bad_field(f"{path}.action", f"must be one of {legal}, got {target.action or 'none'}")
    _vector(target.target_m, f"{path}.target_m", may_be_empty=target.action == kind.Value("RELEASE"))
    _not_negative(target.over_s, f"{path}.over_s")
    _not_negative(target.largest_force_n, f"{path}.largest_force_n")
    if target.action == kind.Value("GRAB_NEAREST"):
        _positive(target.radius_m, f"{path}.radius_m")
    for k, spec in moved:
        if target.slot >= spec.max_grips:
            raise errors.bad_field(f"{path}.slot", f"must be below max_grips of cloths[{k}], {spec.max_grips}, got {target.slot}")
