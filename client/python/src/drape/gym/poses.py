"""Where a sheet starts."""

from __future__ import annotations

import numpy as np


def hanging(x_m, top_m, z_m, yaw_rad, width_m):
    """[7] position and quaternion of a flat grid that hangs in a vertical plane: its first row on top, at height
    `top_m`, the middle of that row over (x, z), turned by `yaw_rad` about the vertical. At yaw 0 the row points along
    +x, and `forward` is +z."""
    half = np.sqrt(0.5)
    c, s = np.cos(yaw_rad / 2), np.sin(yaw_rad / 2)
    # A quarter about x (rows point down), then the yaw.
    quaternion = np.array([half * c, half * s, -half * s, half * c])
    along = row_direction(yaw_rad)
    corner = np.array([x_m, top_m, z_m]) - along * (width_m / 2)
    return np.concatenate([corner, quaternion])


def row_direction(yaw_rad):
    """Unit vector [..., 3] from the first picker to the second."""
    yaw = np.asarray(yaw_rad)
    return np.stack([np.cos(yaw), np.zeros_like(yaw), -np.sin(yaw)], -1)


def forward_direction(yaw_rad):
    """Unit vector [..., 3], level, across the plane of the sheet."""
    yaw = np.asarray(yaw_rad)
    return np.stack([np.sin(yaw), np.zeros_like(yaw), np.cos(yaw)], -1)


def yaw_of(starts):
    """[n]: the yaw of transforms [n, 7] that `hanging` made."""
    return 2 * np.arctan2(starts[..., 4], starts[..., 3])


def lying(starts, rows, columns, size_m, height_m):
    """[n, rows * columns, 3]: the sheet of each start laid down flat where its lowest row hung, forward from there: the
    row that the pickers hold is the farthest."""
    yaw = yaw_of(starts)
    along, ahead = row_direction(yaw)[:, None, None], forward_direction(yaw)[:, None, None]
    column = np.linspace(0, size_m, columns)[None, None, :, None]
    row = (size_m - np.linspace(0, size_m, rows))[None, :, None, None]
    flat = starts[:, None, None, :3] * [1, 0, 1] + along * column + ahead * row + [0, height_m, 0]
    return flat.reshape(len(starts), rows * columns, 3)
