"""What particles are coloured by."""

from __future__ import annotations

import numpy as np

# Blue, white, red and dark to bright, as stops of a scale from 0 to 1.
_DIVERGING = np.array([[33, 102, 172], [146, 197, 222], [247, 247, 247], [244, 165, 130], [178, 24, 43]])
_RISING = np.array([[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]])


def _scaled(stops, values):
    at = np.clip(values, 0, 1) * (len(stops) - 1)
    low = np.minimum(at.astype(int), len(stops) - 2)
    part = (at - low)[..., None]
    return (stops[low] * (1 - part) + stops[low + 1] * part).astype(np.uint8)


def by_speed(velocities):
    """uint8[..., 3] and the speed [m/s] of the brightest colour."""
    speeds = np.linalg.norm(velocities, axis=-1)
    top = max(float(speeds.max(initial=0)), 1e-3)
    return _scaled(_RISING, speeds / top), top


class StrainColours:
    """Colours by the largest stretch (red) or compression (blue) among the distance constraints of each particle,
    against the rest shape."""

    def __init__(self, topology):
        rest, edges = topology.rest_positions, topology.edges
        lengths = np.linalg.norm(rest[edges[:, 0]] - rest[edges[:, 1]], axis=1)
        self.edges, self.lengths = edges[lengths > 0], lengths[lengths > 0]

    def __call__(self, positions):
        """uint8[n, particles, 3] of positions [n, particles, 3], and the strain of the deepest colour."""
        first, second = self.edges.T
        strain = np.linalg.norm(positions[:, first] - positions[:, second], axis=-1) / self.lengths - 1
        largest = np.zeros(positions.shape[:2])
        for row, values in enumerate(strain):
            for ends in (first, second):
                order = np.argsort(np.abs(values), kind="stable")  # the largest is written last
                better = np.abs(values[order]) > np.abs(largest[row, ends[order]])
                largest[row, ends[order][better]] = values[order][better]
        top = max(float(np.abs(largest).max(initial=0)), 1e-4)
        return _scaled(_DIVERGING, 0.5 + 0.5 * largest / top), top

