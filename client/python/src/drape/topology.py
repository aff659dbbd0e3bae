"""Triangles and edges of a description, in the order of the server."""

from __future__ import annotations

import numpy as np

from . import states


def triangles_of(spec) -> np.ndarray:
    """uint32[triangles, 3], counter-clockwise seen from outside (of a grid that lies flat: from above); a chain or a cloth
    made of particles has none. A mesh has those of its drawing."""
    kind = spec.WhichOneof("topology")
    if kind == "mesh":
        return states.unpack(spec.mesh.triangles).reshape(-1, 3)
    if kind != "grid" or spec.grid.columns < 2 or spec.grid.rows < 2:
        return np.empty((0, 3), np.uint32)
    columns, rows = spec.grid.columns, spec.grid.rows
    at = np.arange(rows * columns, dtype=np.uint32).reshape(rows, columns)
    a, right, below, across = at[:-1, :-1], at[:-1, 1:], at[1:, :-1], at[1:, 1:]
    pairs = np.stack([np.stack([a, below, right], -1), np.stack([right, below, across], -1)], axis=2)
    return np.ascontiguousarray(pairs.reshape(-1, 3))


def edges_of(triangles) -> np.ndarray:
    """uint32[edges, 2]: every edge of the triangles once, i < j, sorted."""
    pairs = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.unique(pairs, axis=0)
