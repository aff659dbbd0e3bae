"""What the rows of a cloth's states are."""

from __future__ import annotations

import dataclasses

import numpy as np

from . import states


@dataclasses.dataclass(repr=False)
class Topology:
    """What the rows of a cloth's states are. particles: their number. grid: (columns, rows), None if it is no grid.
    rest_positions [m]: [particles, 3], before any transform. triangles: uint32[t, 3], counter-clockwise seen from
    outside. edges: uint32[e, 2], the distance constraints, without those between two pins. constraints: uint32[e],
    ascending: the index of each in `Cloths.set_rest_lengths`. collider_meshes: index in environment.colliders -> Mesh."""

    particles: int
    grid: tuple | None
    rest_positions: np.ndarray
    triangles: np.ndarray
    edges: np.ndarray
    constraints: np.ndarray
    collider_meshes: dict

    def __repr__(self):
        grid = "" if self.grid is None else f" (a grid of {self.grid[0]} x {self.grid[1]})"
        return (f"<topology of {self.particles} particles{grid}: {len(self.triangles)} triangles, {len(self.edges)} edges, "
                f"{len(self.collider_meshes)} meshes of colliders>")

    @classmethod
    def of(cls, message):
        grid = (message.grid_columns, message.grid_rows) if message.grid_columns else None
        return cls(message.particles, grid, *(states.unpack(array).reshape(-1, *width) for array, width in (
            (message.rest_positions_m, (3,)), (message.triangles, (3,)), (message.edges, (2,)), (message.edge_constraints, ()))),
            {of.collider: of.mesh for of in message.collider_meshes})
