"""The ropes of bodies in a viser scene: straight from their ends over their pulleys, whether taut or not."""

from __future__ import annotations

import numpy as np

from drape.viewer import shapes

_ROPE = (120, 90, 50)
_THICKNESS = 0.003  # of the longest rope [-], as pictures of the server have it


class Ropes:
    """Those of all rows are one set of lines. origins: [rows, 3] of their environments."""

    def __init__(self, scene, name, origins):
        self._scene = scene
        self._name = name
        self._origins = origins
        self._handle = None
        self.parts = np.zeros((0, 2, 3), np.float32)  # as shown

    def show(self, described, place_of):
        """described: the `Cloth` of each shown row. place_of(row, collider, point): where a point of a collider, as
        described, is in the row's environment."""
        parts, longest = [], 0.0
        for row, cloth in enumerate(described):
            for index, collider in enumerate(cloth.environment.colliders):
                for joint in collider.joints:
                    if not joint.HasField("rope_length_m"):
                        continue
                    longest = max(longest, joint.rope_length_m)
                    other = np.array(joint.other_point_m)
                    if joint.HasField("collider"):
                        other = place_of(row, joint.collider, other)
                    along = np.vstack([place_of(row, index, np.array(joint.point_m)),
                                       np.reshape(joint.pulleys_m, (-1, 3)), other]) + self._origins[row]
                    parts += zip(along[:-1], along[1:])
        parts = np.array(parts, np.float32).reshape(-1, 2, 3)
        if np.array_equal(parts, self.parts):
            return
        if self._handle is not None and len(parts) == len(self.parts):
            self._handle.points = parts
        else:
            if self._handle is not None:
                self._handle.remove()
            self._handle = None if not len(parts) else self._scene.add_line_segments(
                self._name, parts, _ROPE, thickness=_THICKNESS * longest)
        self.parts = parts


def placed(pose, pivot, point):
    """[3] a point of a collider, as described, where that has the pose [7], x, y, z and the quaternion x, y, z, w."""
    return np.array(pose[:3]) + shapes.rotation_of(pose[3:]) @ (point - pivot)
