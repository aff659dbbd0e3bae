"""Scores of cloth manipulation, for all environments at once, with the definitions of SoftGym (Lin et al. 2020)."""

from __future__ import annotations

import numpy as np

_CELLS = 100  # a side of the grid on which area is counted, as in SoftGym


def mean_distance(positions, targets):
    """[n]: mean over the particles of their distance [m] to `targets` (what spreads to [n, particles, 3])."""
    return np.sqrt(((positions - targets) ** 2).sum(-1)).mean(-1)


def normalized(performance, start, best):
    """[n]: 0 at the performance at the start of the episode, 1 at the best."""
    return (performance - start) / (best - start)


def covered_cells(points, low, high, radius, cells=_CELLS):
    """bool[n, cells, cells]: the cells of a grid over the boxes low..high ([n, 2]) that lie under a square of half side
    `radius` [m] around one of the points [n, particles, 2]. By sums over corners of squares, not square by square."""
    count = len(points)
    span = np.maximum((high - low) / cells, 1e-9)[:, None]  # [n, 1, 2]
    at = points - low[:, None]
    first = np.clip(np.rint((at - radius) / span), 0, cells).astype(np.int64)
    last = np.clip(np.rint((at + radius) / span), 0, cells).astype(np.int64)
    side = cells + 1
    base = (np.arange(count) * side * side)[:, None]

    def corners(x, y):
        return np.bincount((base + x * side + y).ravel(), minlength=count * side * side)

    sums = (corners(first[..., 0], first[..., 1]) - corners(first[..., 0], last[..., 1])
            - corners(last[..., 0], first[..., 1]) + corners(last[..., 0], last[..., 1]))
    depth = sums.reshape(count, side, side).cumsum(1).cumsum(2)
    return depth[:, :cells, :cells] > 0


def coverage(positions, radius):
    """[n]: area [m^2] that cloths cover, seen from above; each particle covers a square of half side `radius` [m]. The
    grid spans the box around the particles of each cloth."""
    points = positions[..., [0, 2]].astype(np.float64)
    low, high = points.min(1), points.max(1)
    cells = covered_cells(points, low, high, radius)
    return cells.sum((1, 2)) * ((high - low) / _CELLS).prod(-1)


def covered_share(positions, centre, disc_radius, radius, cells=64):
    """[n]: share of a horizontal disc around `centre` (x, z) that cloths cover, seen from above. `radius` as in
    `coverage`."""
    points = positions[..., [0, 2]].astype(np.float64)
    low = np.broadcast_to(np.asarray(centre, np.float64) - disc_radius, (len(points), 2))
    grid = covered_cells(points, low, low + 2 * disc_radius, radius, cells)
    axis = (np.arange(cells) + 0.5) / cells * 2 - 1
    disc = axis[:, None] ** 2 + axis**2 <= 1
    return (grid & disc).sum((1, 2)) / disc.sum()
