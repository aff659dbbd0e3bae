"""Tasks that start with a sheet on the floor and with open pickers above it. Its layers lie on each other, so the
backend is `cpu` or `reference`."""

from __future__ import annotations

import numpy as np

from drape.gym import metrics, poses
from drape.gym.tasks import THICKNESS_M
from drape.gym.vector import TIME_STEP_S, ClothVectorEnv

_ABOVE_M = 0.1  # of the pickers at the start
_APART_M = 0.2


class FloorStart(ClothVectorEnv):
    """A flat sheet at a random place and yaw; the pickers are open, 10 cm above its middle and 20 cm apart. 100 actions
    of 8 steps, at most 1 cm per step, as SoftGym has them."""

    action_repeat = 8
    horizon = 100
    touches_itself = True

    def _draw_start(self, rng):
        x, z = rng.uniform(-0.1, 0.1, 2)
        return poses.on_floor(x, z, rng.uniform(-np.pi, np.pi), self.size_m, THICKNESS_M)

    def _prepare(self, rows, positions):
        middle = positions.mean(1) * [1, 0, 1] + [0, _ABOVE_M, 0]
        aside = poses.row_direction(poses.yaw_of(self._starts[rows])) * (_APART_M / 2)
        self.pickers.begin_open(rows, np.stack([middle - aside, middle + aside], 1))


class FoldHalf(FloorStart):
    """SoftGym's ClothFold: lay the half with the first rows onto the other, row on row, and leave that where it is.

    Performance: minus the mean distance [m] of the particles to their mirror images, and minus 1.2 times the mean
    distance of the other half to where it was. The best is 0, less the distance of two layers.
    """

    def _prepare(self, rows, positions):
        super()._prepare(rows, positions)
        if not self._has_begun:
            self._fixed = np.zeros((self.num_envs, *self._halves(positions)[1].shape[1:]))
        self._fixed[rows] = self._halves(positions)[1]

    def _halves(self, positions):
        """[m, side // 2, side, 3] each: the half that is to move, and that below it, its rows in the order of their
        images. The middle row of an odd number belongs to neither."""
        sheet = positions.reshape(len(positions), self.side, self.side, 3)
        return sheet[:, :self.side // 2], sheet[:, ::-1][:, :self.side // 2]

    def _performance(self, positions, rows):
        moving, below = self._halves(positions)
        apart = np.linalg.norm(moving - below, axis=-1).mean((1, 2))
        moved = np.linalg.norm(below - self._fixed[rows], axis=-1).mean((1, 2))
        return -apart - 1.2 * moved


class Flatten(FloorStart):
    """SoftGym's ClothFlatten: spread out a sheet that was lifted at a random particle and dropped, wherever.

    Performance: covered area as a share of that of the flat sheet, at most 1. A reset simulates lift and fall, for
    2.5 s of the sheet's time.
    """

    best_performance = 1.0

    def _settle(self, rows, positions):
        draws = [self._generators[k] for k in rows]
        particles = np.array([[rng.integers(self.cloths.particles)] for rng in draws])
        lifts = np.array([rng.uniform(0.5, 1.0) * self.size_m for rng in draws])
        at = positions[np.arange(len(rows)), particles[:, 0]]
        self.cloths.grip(0, particles=particles, at=at[:, None], ids=rows)
        self.cloths.move_grips(0, (at + lifts[:, None] * [0, 1, 0])[:, None], over_s=0.75, ids=rows)
        self.cloths.step(round(1.0 / TIME_STEP_S), view=None, ids=rows)
        self.cloths.release(0, ids=rows)
        return self.cloths.step(round(1.5 / TIME_STEP_S), ids=rows).positions

    def _performance(self, positions, rows):
        return np.minimum(1.0, metrics.coverage(positions, self._stamp_m) / self.size_m**2)
