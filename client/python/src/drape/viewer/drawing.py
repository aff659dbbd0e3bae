"""One batch of cloths in a viser scene: its surface, its pins, its colliders."""

from __future__ import annotations

import numpy as np

from drape import topology, v1
from drape.viewer import colours, shapes

_CLOTH = (86, 142, 200)
_PIN = (220, 60, 40)
_COLLIDER = (150, 150, 150)


class Drawing:
    """All cloths of a batch are one mesh, so that the number of messages does not depend on theirs."""

    def __init__(self, scene, name, cloths, stride=1):
        self.cloths = cloths
        self._scene = scene
        self._name = name
        self._rows = np.arange(0, cloths.num, stride)
        self._strain = None
        positions = cloths.positions[self._rows]
        self._surface = self._dots = self._pins = None
        triangles = topology.triangles_of(cloths.spec) if cloths.spec is not None else np.empty((0, 3), np.uint32)
        if len(triangles):
            first = (np.arange(len(self._rows)) * cloths.particles).astype(np.uint32)
            faces = (triangles[None] + first[:, None, None]).reshape(-1, 3)
            self._surface = scene.add_mesh_simple(f"{name}/surface", _flat(positions), faces, color=_CLOTH, side="double")
        self._size_m = _spacing(positions[0], triangles)
        self._show_dots(_flat(positions), np.broadcast_to(np.uint8(_CLOTH), (positions.size // 3, 3)),
                        is_shown=self._surface is None)
        self._pinned = [pin.particle for pin in cloths.spec.pins] if cloths.spec is not None else []
        self._colliders = self._add_colliders()
        self.update("cloth")

    def update(self, colouring):
        """Shows the present states. colouring: "cloth", "strain" or "speed". Returns the value of the deepest colour."""
        positions = self.cloths.positions[self._rows]
        flat, top = _flat(positions), None
        if self._surface is not None:
            self._surface.vertices = flat
        if colouring == "cloth":
            self._dots.visible = self._surface is None
            if self._surface is None:
                self._dots.points = flat
        else:
            if colouring == "speed":
                paint, top = colours.by_speed(self.cloths.velocities[self._rows])
            else:
                self._strain = self._strain or colours.StrainColours(self.cloths.spec)
                paint, top = self._strain(positions)
            self._show_dots(flat, paint.reshape(-1, 3), is_shown=True)
        if self._pinned:
            points = _flat(positions[:, self._pinned])
            if self._pins is None:
                self._pins = self._scene.add_point_cloud(f"{self._name}/pins", points, _PIN, point_size=0.8 * self._size_m,
                                                         point_shape="circle", precision="float32")
            else:
                self._pins.points = points
        self._move_colliders()
        return top

    def can_colour(self, colouring):
        if colouring != "strain":
            return True
        return self.cloths.spec is not None and self.cloths.spec.WhichOneof("topology") in ("grid", "mesh")

    def _show_dots(self, points, paint, is_shown):
        if self._dots is None:
            self._dots = self._scene.add_point_cloud(f"{self._name}/particles", points, paint, point_size=self._size_m,
                                                     point_shape="circle", precision="float32")
        else:
            self._dots.points, self._dots.colors = points, paint
        self._dots.visible = is_shown

    def _add_colliders(self):
        spec = self.cloths.spec
        environment = spec.environment if spec is not None else self.cloths.describe(0).environment
        origins = self.cloths.origins if self.cloths.origins is not None else np.zeros((self.cloths.num, 3))
        origins = np.unique(origins[self._rows], axis=0)
        handles = []
        for k, collider in enumerate(environment.colliders):
            vertices, faces, pivot = shapes.shape_of(collider) if len(_mesh_data(collider)) else (None, None, None)
            if vertices is None:
                handles.append(None)  # the server leaves out the arrays of meshes
                continue
            # A plane is the same everywhere along itself: one is enough.
            places = origins[:1] if collider.WhichOneof("shape") == "plane" else origins
            unit = np.tile([1.0, 0, 0, 0], (len(places), 1))
            handles.append((self._scene.add_batched_meshes_simple(
                f"{self._name}/collider_{k}", vertices, faces, unit, places + pivot, batched_colors=_COLLIDER,
                side="double"), places))
        moves = any(collider.velocity_m_per_s or collider.angular_velocity_rad_per_s for collider in environment.colliders)
        self._colliders_move = moves
        return handles

    def track_colliders(self):
        """From now on asks the server where the colliders are, each time."""
        self._colliders_move = True

    def _move_colliders(self):
        if not self._colliders_move or not self._colliders:
            return
        for handle, pose in zip(self._colliders, self.cloths.describe(int(self._rows[0])).collider_poses):
            if handle is None:
                continue
            batch, places = handle
            x, y, z, w = pose.rotation_xyzw or (0, 0, 0, 1)
            batch.batched_positions = (places + np.array(pose.position_m)).astype(np.float32)
            batch.batched_wxyzs = np.tile(np.float32([w, x, y, z]), (len(places), 1))


def _mesh_data(collider: v1.Collider):
    return collider.mesh.positions_m.data if collider.WhichOneof("shape") == "mesh" else b"any"


def _flat(positions):
    return np.ascontiguousarray(positions, np.float32).reshape(-1, 3)


def _spacing(positions, triangles):
    """A size for dots [m]: the mean edge, or a share of the whole where there are no triangles."""
    if len(triangles):
        edges = topology.edges_of(triangles[:2000])
        return float(np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1).mean())
    return float(max(np.ptp(positions, axis=0).max() / 50, 1e-3))
