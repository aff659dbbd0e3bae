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


def on_floor(x_m, z_m, yaw_rad, size_m, height_m):
    """[7] position and quaternion of a square grid that lies at `height_m`, its middle over (x, z), turned by `yaw_rad`
    about the vertical: its rows point as those of `hanging`, and follow each other along `forward_direction`."""
    middle = (row_direction(yaw_rad) + forward_direction(yaw_rad)) * (size_m / 2)
    corner = np.array([x_m, height_m, z_m]) - middle
    return np.concatenate([corner, [0, np.sin(yaw_rad / 2), 0, np.cos(yaw_rad / 2)]])


def row_direction(yaw_rad):
    """Unit vector [..., 3] from the first picker to the second."""
    yaw = np.asarray(yaw_rad)
    return np.stack([np.cos(yaw), np.zeros_like(yaw), -np.sin(yaw)], -1)


def forward_direction(yaw_rad):
    """Unit vector [..., 3], level, across the plane of the sheet."""
    yaw = np.asarray(yaw_rad)
    return np.stack([np.sin(yaw), np.zeros_like(yaw), np.cos(yaw)], -1)


def yaw_of(starts):
    """[n]: the yaw of transforms [n, 7] that `hanging` or `on_floor` made."""
    return 2 * np.arctan2(starts[..., 4], starts[..., 6])


def turned(vectors, yaw_rad):
    """Vectors [n, k, 3] turned by the yaws [n] about the vertical: those along +x then point along `row_direction`."""
    along, ahead = row_direction(yaw_rad)[:, None], forward_direction(yaw_rad)[:, None]
    return vectors[..., :1] * along + vectors[..., 1:2] * [0.0, 1.0, 0.0] + vectors[..., 2:] * ahead


def seen_from(starts, size_m, points):
    """Points [n, k, 3] of the world in frames on the floor, below the middle of the first row of each start [n, 7]: x
    along that row, z forward."""
    yaw = yaw_of(starts)
    origin = starts[:, :3] * [1, 0, 1] + row_direction(yaw) * (size_m / 2)
    return turned(points - origin[:, None], -yaw)


def lying(starts, rows, columns, size_m, height_m):
    """[n, rows * columns, 3]: the sheet of each start laid down flat where its lowest row hung, forward from there: the
    row that the pickers hold is the farthest."""
    yaw = yaw_of(starts)
    along, ahead = row_direction(yaw)[:, None, None], forward_direction(yaw)[:, None, None]
    column = np.linspace(0, size_m, columns)[None, None, :, None]
    row = (size_m - np.linspace(0, size_m, rows))[None, :, None, None]
    flat = starts[:, None, None, :3] * [1, 0, 1] + along * column + ahead * row + [0, height_m, 0]
    return flat.reshape(len(starts), rows * columns, 3)


def over_rail(middle_m, turned, side, size_m, height_m, radius_m):
    """[n, side * side, 3]: square sheets that hang over a rail along x at `height_m` above the origin, half on each
    side, `radius_m` from its axis. middle_m [n]: x of the middle of each. turned bool[n]: rows point along -x and the
    first is at -z; else they point along +x and the first is at +z."""
    along = np.linspace(-0.5, 0.5, side) * size_m  # of a row; and from the rail to each row, over the sheet
    quarter = radius_m * np.pi / 2
    angle = np.clip(-along, -quarter, quarter) / radius_m
    below = np.maximum(np.abs(along) - quarter, 0)
    hung = np.zeros((side, side, 3))
    hung[..., 0] = along
    hung[..., 1] = (height_m + radius_m * np.cos(angle) - below)[:, None]
    hung[..., 2] = (radius_m * np.sin(angle))[:, None]
    turn = np.where(turned, -1.0, 1.0)[:, None, None, None]
    placed = hung * np.concatenate([turn, np.ones_like(turn), turn], -1)
    placed[..., 0] += np.asarray(middle_m)[:, None, None]
    return placed.reshape(-1, side * side, 3)
