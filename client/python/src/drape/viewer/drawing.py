"""One batch of cloths in a viser scene: its surface, its pins, its colliders."""

from __future__ import annotations

import numpy as np

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
        self._topology = cloths.topology()
        triangles = self._topology.triangles
        if len(triangles):
            first = (np.arange(len(self._rows)) * cloths.particles).astype(np.uint32)
            faces = (triangles[None] + first[:, None, None]).reshape(-1, 3)
            self._surface = scene.add_mesh_simple(f"{name}/surface", _flat(positions), faces, color=_CLOTH, side="double")
        self._size_m = _spacing(positions[0], self._topology.edges)
        self._show_dots(_flat(positions), np.broadcast_to(np.uint8(_CLOTH), (positions.size // 3, 3)),
                        is_shown=self._surface is None)
        self._described = cloths.describe(int(self._rows[0]))
        self._pinned = [pin.particle for pin in self._described.pins]
        self._colliders = self._add_colliders()
        self.update("cloth")

    @property
    def grip(self):
        """The grip by which the viewer pulls: the last of each cloth; None if they have none."""
        return self._described.max_grips - 1 if self._described.max_grips else None

    def on_drag(self, callback):
        """callback(drawing, phase, start [3], end [3]) for shift and the left button on the surface."""
        if self._surface is None or self.grip is None:
            return

        @self._surface.on_drag("left", modifier="shift")
        async def _(event):  # a coroutine, so that events come in order
            callback(self, event.phase, np.array(event.start_position), np.array(event.end_position))

    def nearest(self, point):
        """Row in the batch and particle of what is shown nearest to `point`."""
        distances = ((self.cloths.positions[self._rows] - point) ** 2).sum(-1)
        row, particle = np.unravel_index(distances.argmin(), distances.shape)
        return int(self._rows[row]), int(particle)

    def update(self, colouring):
        """Shows the present states. colouring: "cloth", "strain" or "speed". Returns the value of the deepest
        colour."""
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
                self._strain = self._strain or colours.StrainColours(self._topology)
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
        return colouring != "strain" or len(self._topology.edges) > 0

    def _show_dots(self, points, paint, is_shown):
        if self._dots is None:
            self._dots = self._scene.add_point_cloud(f"{self._name}/particles", points, paint, point_size=self._size_m,
                                                     point_shape="circle", precision="float32")
        else:
            self._dots.points, self._dots.colors = points, paint
        self._dots.visible = is_shown

    def _add_colliders(self):
        environment = self._described.environment
        origins = self.cloths.origins if self.cloths.origins is not None else np.zeros((self.cloths.num, 3))
        origins = np.unique(origins[self._rows], axis=0)
        handles = []
        for k, collider in enumerate(environment.colliders):
            if k in self._topology.collider_meshes:
                collider.mesh.CopyFrom(self._topology.collider_meshes[k])
            vertices, faces, pivot = shapes.shape_of(collider)
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
            batch, places = handle
            x, y, z, w = pose.rotation_xyzw or (0, 0, 0, 1)
            batch.batched_positions = (places + np.array(pose.position_m)).astype(np.float32)
            batch.batched_wxyzs = np.tile(np.float32([w, x, y, z]), (len(places), 1))


def _flat(positions):
    return np.ascontiguousarray(positions, np.float32).reshape(-1, 3)


def _spacing(positions, edges):
    """A size for dots [m]: the mean edge, or a share of the whole where there are none."""
    if len(edges):
        return float(np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1).mean())
    return float(max(np.ptp(positions, axis=0).max() / 50, 1e-3))
