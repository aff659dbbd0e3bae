"""The colliders of a batch in a viser scene, and their ropes: each row's own, where that has them."""

from __future__ import annotations

import numpy as np

from drape import v1
from drape.viewer import shapes
from drape.viewer.ropes import Ropes, placed

_COLLIDER = (150, 150, 150)
# Of a Collider: how it moves, not what it looks like.
_MOTION = ("velocity_m_per_s", "angular_velocity_rad_per_s")


class Colliders:
    """Equal colliders are one mesh at many places, so that the number of messages does not depend on the number of
    cloths. rows: those of `cloths` that are shown; origins: [rows, 3] of their environments."""

    def __init__(self, scene, name, cloths, rows, origins):
        self._scene = scene
        self._name = name
        self._cloths = cloths
        self._rows = rows
        self._origins = origins
        self._environments: list[v1.Environment] = []
        self._kinds: list[_Kind] = []
        self._made = 0
        self._pivots: dict[tuple[int, int], np.ndarray] = {}  # by row and index
        self._ropes = Ropes(scene, f"{name}/ropes", origins)
        self.move_by_themselves = False

    def show(self, described):
        """described: the `Cloth` of each shown row."""
        environments = [cloth.environment for cloth in described]
        if environments != self._environments:
            self._environments = environments
            self._sort()
        for kind in self._kinds:
            kind.place(self._scene, described, self._origins)

        def place_of(row, index, point):
            pivot = self._pivots[row, index]
            return placed(_pose_of(described[row], index, pivot), pivot, point)

        self._ropes.show(place_of)

    @property
    def places(self):
        """Of each mesh: the index of its collider, the shown rows that have it, and its viser handle."""
        return [(kind.index, kind.rows, kind.handle) for kind in self._kinds]

    def _sort(self):
        """Equal colliders to one kind. Keeps those of before."""
        self.move_by_themselves = False  # by a velocity, or as bodies
        sorted_rows: dict[tuple, list] = {}
        for at, environment in enumerate(self._environments):
            for index, collider in enumerate(environment.colliders):
                self.move_by_themselves |= shapes.is_body(collider) or any(getattr(collider, field) for field in _MOTION)
                sorted_rows.setdefault((index, _looks(collider)), []).append(at)
        before = {(kind.index, kind.looks): kind for kind in self._kinds}
        self._kinds = []
        for (index, looks), rows in sorted_rows.items():
            kind = before.pop((index, looks), None)
            if kind is None:
                kind = self._kind_of(index, looks, rows[0])
            kind.rows = rows
            self._kinds.append(kind)
        for kind in before.values():
            kind.remove()
        self._pivots = {(row, kind.index): kind.pivot for kind in self._kinds for row in kind.rows}
        self._ropes.sort(self._environments)

    def _kind_of(self, index, looks, at):
        collider = v1.Collider.FromString(looks)
        if collider.WhichOneof("shape") == "mesh":  # whose arrays descriptions leave out: those of the first row
            collider.mesh.CopyFrom(self._cloths.topology(int(self._rows[at])).collider_meshes[index])
        self._made += 1
        return _Kind(f"{self._name}/collider_{index}_{self._made}", index, looks, collider)


def _looks(collider):
    """Equal bytes of colliders that look alike."""
    own = v1.Collider()
    own.CopyFrom(collider)
    for field in _MOTION:
        own.ClearField(field)
    return own.SerializeToString(deterministic=True)


class _Kind:
    """One collider as some rows have it."""

    def __init__(self, name, index, looks, collider):
        self.index = index
        self.looks = looks
        self.rows = []
        self.handle = None
        self._poses = None  # [rows, 7] as shown
        self._name = name
        self._collider = collider
        self._vertices, self._faces, self.pivot = shapes.shape_of(collider)

    def remove(self):
        if self.handle is not None:
            self.handle.remove()

    def place(self, scene, described, origins):
        poses = np.array([_pose_of(described[at], self.index, self.pivot) for at in self.rows])
        poses[:, :3] += origins[self.rows]
        if np.array_equal(poses, self._poses):
            return
        self._poses = poses
        some = poses[self._unlike(poses)].astype(np.float32)
        positions, wxyzs = some[:, :3], some[:, [6, 3, 4, 5]]
        if self.handle is not None and len(self.handle.batched_positions) == len(positions):
            self.handle.batched_positions, self.handle.batched_wxyzs = positions, wxyzs
            return
        self.remove()
        self.handle = scene.add_batched_meshes_simple(self._name, self._vertices, self._faces, wxyzs, positions,
                                                      batched_colors=_COLLIDER, side="double")

    def _unlike(self, poses):
        """Indices of one of each place where it looks different."""
        keys = poses
        if self._collider.WhichOneof("shape") == "plane":  # the same everywhere along itself
            normal = np.array(self._collider.plane.normal) / np.linalg.norm(self._collider.plane.normal)
            axis, w = poses[:, 3:6], poses[:, 6:]
            normals = normal + 2 * np.cross(axis, np.cross(axis, normal) + w * normal)
            keys = np.column_stack([normals, (normals * poses[:, :3]).sum(1)])
        return np.sort(np.unique(np.round(keys, 9), axis=0, return_index=True)[1])


def _pose_of(cloth, index, pivot):
    """[7] position in the environment and quaternion x, y, z, w."""
    if index >= len(cloth.collider_poses):  # nothing has moved
        return (*pivot, 0, 0, 0, 1)
    pose = cloth.collider_poses[index]
    return (*pose.position_m, *(pose.rotation_xyzw or (0, 0, 0, 1)))
