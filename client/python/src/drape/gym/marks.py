"""What the server does not draw of a task: its pickers, and the outline of where the sheet is to go."""

from __future__ import annotations

import numpy as np

HOLDS, OPEN, TARGET = (20, 40, 140), (235, 120, 20), (200, 30, 60)  # colours of pickers and outlines
_PICKER_PX, _LINE_PX = 3.4, 0.0  # radii
_NEAR_M = 0.03  # what lies less than this behind the cloth, or in it, is shown
_PER_EDGE = 4  # points of an outline between two particles


def outline(sheets, side):
    """[n, k, 3]: points along the edges of sheets [n, side * side, 3]."""
    grid = sheets.reshape(len(sheets), side, side, 3)
    ring = np.concatenate([grid[:, 0], grid[:, 1:, -1], grid[:, -1, -2::-1], grid[:, -2::-1, 0]], 1)
    share = (np.arange(_PER_EDGE) / _PER_EDGE)[:, None]
    points = ring[:, :-1, None] * (1 - share) + ring[:, 1:, None] * share
    return points.reshape(len(sheets), -1, 3)


def projected(camera, points, width, height):
    """Where a camera shows points [n, k, 3]: columns and rows, [n, k] each, from the left and from above, and the distances
    along the line of view [m]."""
    eye = np.array(camera.eye_m)
    ahead = np.array(camera.target_m) - eye
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, list(camera.up) or [0, 1, 0])
    right /= np.linalg.norm(right)
    seen = (points - eye) @ np.stack([right, np.cross(right, ahead), ahead], 1)
    distance = np.maximum(seen[..., 2], 1e-6)
    scale = height / 2 / np.tan(camera.vertical_field_of_view_rad / 2) / distance
    return width / 2 + scale * seen[..., 0], height / 2 - scale * seen[..., 1], seen[..., 2]


def draw(pictures, depths, camera, pickers, holds, outlines):
    """Into pictures uint8[n, height, width, 3], whose depths are float32[n, height, width]: pickers at [n, k, 3], in one
    colour where they hold something (bool[n, k]) and another where they are open, and outlines [n, k, 3] or None."""
    if outlines is not None:
        _dots(pictures, depths, camera, outlines, np.ones(outlines.shape[:2], bool), TARGET, _LINE_PX)
    _dots(pictures, depths, camera, pickers, holds, HOLDS, _PICKER_PX)
    _dots(pictures, depths, camera, pickers, ~holds, OPEN, _PICKER_PX)


def _dots(pictures, depths, camera, points, chosen, colour, radius_px):
    """Discs at those of the points that are chosen and not hidden."""
    _, height, width = depths.shape
    column, row, distance = projected(camera, points, width, height)
    environment = np.broadcast_to(np.arange(len(points))[:, None], column.shape)
    column, row = np.floor(column).astype(int), np.floor(row).astype(int)
    reach = range(-int(radius_px), int(radius_px) + 1)
    for right, down in ((x, y) for x in reach for y in reach if x * x + y * y <= radius_px**2):
        x, y = column + right, row + down
        shown = chosen & (distance > 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
        at = environment[shown], y[shown], x[shown]
        is_seen = distance[shown] <= depths[at] + _NEAR_M
        pictures[tuple(index[is_seen] for index in at)] = colour
