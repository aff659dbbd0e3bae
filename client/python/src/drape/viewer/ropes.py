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
        self._ropes = []  # (row, index of its collider, `BodyJoint`) of each
        self._handle = None
        self.parts = np.zeros((0, 2, 3), np.float32)  # as shown

    def sort(self, environments):
        """The `Environment` of each shown row, at first and whenever one of them has changed."""
        self._ropes = [(row, index, joint) for row, environment in enumerate(environments)
                       for index, collider in enumerate(environment.colliders)
                       for joint in collider.joints if joint.HasField("rope_length_m")]
        if self._handle is not None:  # as many as before may be longer, and then thicker
            self._handle.remove()
        self._handle = None
        self.parts = self.parts[:0]

    def show(self, place_of):
        """place_of(row, collider, point): where a point of a collider, as described, is in the row's environment."""
        if not self._ropes:
            return
        parts = []
        for row, index, joint in self._ropes:
            other = np.array(joint.other_point_m)
            if joint.HasField("collider"):
                other = place_of(row, joint.collider, other)
            along = np.vstack([place_of(row, index, np.array(joint.point_m)),
                               np.reshape(joint.pulleys_m, (-1, 3)), other]) + self._origins[row]
            parts += zip(along[:-1], along[1:])
        parts = np.array(parts, np.float32)
        if np.array_equal(parts, self.parts):
            return
        self.parts = parts
        if self._handle is not None:
            self._handle.points = parts
            return
        longest = max(joint.rope_length_m for _, _, joint in self._ropes)
        self._handle = self._scene.add_line_segments(self._name, parts, _ROPE, thickness=_THICKNESS * longest)


def placed(pose, pivot, point):
    """[3] a point of a collider, as described, where that has the pose [7], x, y, z and the quaternion x, y, z, w."""
    return np.array(pose[:3]) + shapes.rotation_of(pose[3:]) @ (point - pivot)
