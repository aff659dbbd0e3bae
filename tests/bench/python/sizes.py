"""`./run bench python --case sizes`: a step of as many particles in cloths of one size and of several, in one request and in
turn. Cloths share the lanes of vector registers with those of the same shape alone."""

import itertools
import time

import numpy as np

from drape import ClothSpec, Grid, Pin

CLOTHS, SIDE = 64, 32
SIZES = (1, 2, 4, 8, 16, 32, 64)
STEPS, ROUNDS, WARM_UP_STEPS = 10, 15, 30


def hung(columns, rows):
    """As of `session.create` by default, by two corners."""
    return ClothSpec(grid=Grid(columns=columns, rows=rows, width_m=1, height_m=1), pins=[Pin(particle=0), Pin(particle=columns - 1)])


def measure(client, is_quick):
    """A row per number of sizes: the grids that have about SIDE² particles, as many cloths of each."""
    edges = range(SIDE - 8, SIDE + 9)
    grids = sorted(itertools.product(edges, edges), key=lambda grid: (abs(grid[0] * grid[1] - SIDE**2), grid != (SIDE, SIDE)))
    with client.session() as session:
        ways = {count: [session.create(hung(*grid), CLOTHS // count) for grid in grids[:count]] for count in SIZES}
        per_particle = {count: [] for count in SIZES}
        for batches in ways.values():
            session.step(batches, WARM_UP_STEPS)
        for _ in range(2 if is_quick else ROUNDS):
            for count, batches in ways.items():
                begin = time.perf_counter()
                session.step(batches, STEPS)
                wall_ms = 1e3 * (time.perf_counter() - begin) / STEPS
                per_particle[count].append(wall_ms / sum(batch.num * batch.particles for batch in batches))
    equal = np.array(per_particle[1])
    return [{"sizes": count, "cloths_of_each": CLOTHS // count, "wall_ms": np.median(per_particle[count]) * CLOTHS * SIDE**2,
             "ratio": np.median(per_particle[count] / equal)} for count in SIZES]
