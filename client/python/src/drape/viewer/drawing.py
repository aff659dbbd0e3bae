"""One batch of cloths in a viser scene: its surface, its pins, its colliders."""

from __future__ import annotations

import numpy as np

from drape.viewer import colours
from drape.viewer.colliders import Colliders

_CLOTH = (86, 142, 200)
_PIN = (220, 60, 40)


class Drawing:
    """All cloths of a batch are one mesh, so that the number of messages does not depend on theirs. Pins, colliders and
    grips are those that each of them has."""

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
        origins = cloths.origins if cloths.origins is not None else np.zeros((cloths.num, 3))
        self._colliders = Colliders(scene, name, cloths, self._rows, np.asarray(origins, float)[self._rows])
        self._tracks = False
        self.describe()
        self.update("cloth")

    def describe(self):
        """Asks the server anew for pins, colliders and grips of the cloths that are shown."""
        self._described = self.cloths.descriptions(self._rows)
        self._described_at = self.cloths.step_count[self._rows].copy()
        pins = [(at, pin.particle) for at, cloth in enumerate(self._described) for pin in cloth.pins]
        self._pinned = np.array(pins, int).reshape(-1, 2)
        self._colliders.show(self._described)

    def grip_of(self, row):
        """The grip by which the viewer pulls a shown row of the batch: the last it has; None if it has none."""
        grips = self._described[int(np.flatnonzero(self._rows == row)[0])].max_grips
        return grips - 1 if grips else None

    def why_not_pulled(self):
        """Why the mouse pulls no cloth of this batch; "" if it does."""
        if self._surface is None:
            return "they have no triangles"
        if not any(cloth.max_grips for cloth in self._described):
            return "they have no grips (`ClothSpec.max_grips`)"
        return ""

    def on_drag(self, callback):
        """callback(drawing, phase, start [3], end [3]) for shift and the left button on the surface, if they can pull
        it."""
        if self.why_not_pulled():
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
        if (self._tracks or self._colliders.move_by_themselves) and (
                self.cloths.step_count[self._rows] != self._described_at).any():
            self.describe()
        self._show_pins(positions)
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

    def _show_pins(self, positions):
        points = np.ascontiguousarray(positions[self._pinned[:, 0], self._pinned[:, 1]], np.float32)
        if self._pins is not None and len(self._pins.points) == len(points):
            self._pins.points = points
            return
        if self._pins is not None:
            self._pins.remove()
        self._pins = None if not len(points) else self._scene.add_point_cloud(
            f"{self._name}/pins", points, _PIN, point_size=0.8 * self._size_m, point_shape="circle", precision="float32")

    def track(self):
        """From now on asks the server what moves besides the cloths after every step, since others move it."""
        self._tracks = True


def _flat(positions):
    return np.ascontiguousarray(positions, np.float32).reshape(-1, 3)


def _spacing(positions, edges):
    """A size for dots [m]: the mean edge, or a share of the whole where there are none."""
    if len(edges):
        return float(np.linalg.norm(positions[edges[:, 0]] - positions[edges[:, 1]], axis=1).mean())
    return float(max(np.ptp(positions, axis=0).max() / 50, 1e-3))
