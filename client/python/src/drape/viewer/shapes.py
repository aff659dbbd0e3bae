"""Colliders as triangles."""

from __future__ import annotations

import numpy as np

from drape import states, v1

_PLANE_M = 20.0  # side of the square that stands for a plane
_SECTIONS = 24


def shape_of(collider: v1.Collider):
    """vertices float32[v, 3] relative to the collider's pivot, faces uint32[f, 3], and the pivot [3] as described, in
    the frame of the environment. That of a body is its centre of mass."""
    kind = collider.WhichOneof("shape")
    vertices, faces, pivot = _MAKERS[kind](getattr(collider, kind), collider)
    if is_body(collider):
        pivot = _centre_of(vertices[faces.astype(np.int64)])
    elif collider.pivot_m:
        pivot = np.array(collider.pivot_m)
    return (vertices - pivot).astype(np.float32), faces.astype(np.uint32), pivot


def is_body(collider: v1.Collider):
    """Whether it is a rigid body, which moves by what pushes it."""
    return collider.HasField("density_kg_per_m3") or collider.HasField("mass_kg")


def _centre_of(corners):
    """[3] of the solid within triangles [f, 3, 3]: the mean of tetrahedra to a point amid them, by their volumes."""
    amid = corners.mean((0, 1))
    a, b, c = np.moveaxis(corners - amid, 1, 0)
    volumes = (a * np.cross(b, c)).sum(-1)
    return amid + (volumes[:, None] * (a + b + c)).sum(0) / (4 * volumes.sum())


def rotation_of(xyzw):
    """[3, 3]; an empty quaternion is no rotation."""
    if not len(xyzw):
        return np.eye(3)
    x, y, z, w = np.array(xyzw) / np.linalg.norm(xyzw)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def _frame(axis):
    """[3, 3], its third column along `axis`."""
    axis = np.array(axis, float) / np.linalg.norm(axis)
    side = np.cross(axis, [1, 0, 0] if abs(axis[0]) < 0.9 else [0, 1, 0])
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(axis, side), axis], axis=1)


def _revolved(profile):
    """A surface of revolution about z: profile [k, 2] of radius and height, from the lower pole to the upper."""
    angles = np.linspace(0, 2 * np.pi, _SECTIONS, endpoint=False)
    radius, height = profile[:, 0, None], profile[:, 1, None]
    ring = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.broadcast_to(height, (len(profile), _SECTIONS))], -1)
    at = np.arange(len(profile) * _SECTIONS).reshape(len(profile), _SECTIONS)
    a, b = at[:-1], np.roll(at, -1, 1)[:-1]
    c, d = at[1:], np.roll(at, -1, 1)[1:]
    faces = np.concatenate([np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)])
    return ring.reshape(-1, 3), faces


def _arc(radius, centre, begin, end):
    angles = np.linspace(begin, end, _SECTIONS // 2)
    return np.stack([radius * np.cos(angles), centre + radius * np.sin(angles)], -1)


def _sphere(sphere, _):
    vertices, faces = _revolved(_arc(sphere.radius_m, 0, -np.pi / 2, np.pi / 2))
    return vertices + sphere.center_m, faces, np.array(sphere.center_m)


def _between(shape, profile):
    a, b = np.array(shape.a_m), np.array(shape.b_m)
    length = np.linalg.norm(b - a)
    vertices, faces = _revolved(profile(length / 2))
    return vertices @ _frame(b - a if length > 0 else [0, 0, 1]).T + (a + b) / 2, faces, (a + b) / 2


def _capsule(capsule, _):
    radius = capsule.radius_m
    return _between(capsule, lambda half: np.concatenate(
        [_arc(radius, -half, -np.pi / 2, 0), _arc(radius, half, 0, np.pi / 2)]))


def _cylinder(cylinder, _):
    radius = cylinder.radius_m
    return _between(cylinder, lambda half: np.array([[0, -half], [radius, -half], [radius, half], [0, half]]))


def _plane(plane, _):
    frame = _frame(plane.normal)
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * (_PLANE_M / 2)
    return square @ frame.T + plane.point_m, np.array([[0, 1, 2], [0, 2, 3]]), np.array(plane.point_m)


def _box(box, _):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * box.half_extents_m
    faces = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6],
                      [0, 6, 4], [1, 5, 7], [1, 7, 3]])
    return corners @ rotation_of(box.rotation_xyzw).T + box.center_m, faces, np.array(box.center_m)


def _mesh(mesh, collider):
    place = np.array(collider.transform.position_m or [0, 0, 0])
    vertices = states.unpack(mesh.positions_m).reshape(-1, 3) @ rotation_of(collider.transform.rotation_xyzw).T + place
    return vertices, states.unpack(mesh.triangles).reshape(-1, 3), place


_MAKERS = {"sphere": _sphere, "capsule": _capsule, "cylinder": _cylinder, "plane": _plane, "box": _box, "mesh": _mesh}
