"""Tasks that start with a sheet that hangs from two pickers, at a random place and yaw."""

from __future__ import annotations

import numpy as np

from drape import v1
from drape.gym import marks, metrics, poses
from drape.gym.vector import ClothVectorEnv

THICKNESS_M = 0.005  # what the cloth keeps from the floor (ClothVectorEnv._material)


class HangingStart(ClothVectorEnv):
    """Height of the pickers above that at which the lowest row touches the floor: 2 to 10 cm."""

    def _draw_start(self, rng):
        top = self.size_m + rng.uniform(0.02, 0.10)
        x, z = rng.uniform(-0.1, 0.1, 2)
        return poses.hanging(x, top, z, rng.uniform(-np.pi, np.pi), self.size_m)


class DropFlat(HangingStart):
    """SoftGym's ClothDrop: lay the sheet down flat on a target, which begins where its lowest row hangs.

    Performance: minus the mean distance [m] of the particles to the target; the best is 0. 30 actions of 16 steps, at
    most 1 cm per step.
    """

    action_repeat = 16
    horizon = 30

    def _prepare(self, rows, positions):
        super()._prepare(rows, positions)
        if not self._has_begun:
            self._targets = np.zeros((self.num_envs, self.cloths.particles, 3), np.float32)
        self._targets[rows] = poses.lying(self._starts[rows], self.side, self.side, self.size_m, THICKNESS_M)

    def _outlines(self, rows):
        return marks.outline(self._targets[rows], self.side)

    def _performance(self, positions, rows):
        return -metrics.mean_distance(positions, self._targets[rows])


class FlingFlat(HangingStart):
    """FlingBot's aim from a hanging start: spread the sheet out, wherever, by fast motions.

    Performance: covered area as a share of that of the flat sheet, at most 1. 40 actions of 4 steps, at most 5 cm per
    step (3 m/s).
    """

    action_repeat = 4
    horizon = 40
    picker_step_m = 0.05
    best_performance = 1.0

    def _performance(self, positions, rows):
        return np.minimum(1.0, metrics.coverage(positions, self._stamp_m) / self.size_m**2)


class CoverSphere(HangingStart):
    """DeformableRavens' cover, with a sphere: hide it under the sheet, seen from above.

    The sphere (radius 8 cm) lies at the origin; the sheet hangs 25 to 30 cm beside it, and turns its face to it.
    Performance: covered share of the sphere's disc; the best is 1. 30 actions of 16 steps, at most 1 cm per step.
    """

    action_repeat = 16
    horizon = 30
    best_performance = 1.0
    radius_m = 0.08

    def _environment(self):
        ground = super()._environment()
        ground.colliders.add(sphere=v1.Sphere(center_m=[0, self.radius_m, 0], radius_m=self.radius_m))
        return ground

    def _draw_start(self, rng):
        yaw = rng.uniform(-np.pi, np.pi)
        away = rng.uniform(0.25, 0.30)
        x, _, z = -poses.forward_direction(yaw) * away
        return poses.hanging(x, self.size_m + rng.uniform(0.05, 0.15), z, yaw, self.size_m)

    def _performance(self, positions, rows):
        return metrics.covered_share(positions, (0, 0), self.radius_m, self._stamp_m)


class Hang(HangingStart):
    """Hang the sheet over a rail, like a towel: dedo's hanging, with SoftGym's score.

    The rail (radius 2 cm) lies along x, 40 cm above the floor; the sheet hangs 15 to 25 cm beside it, its rows along
    the rail to 0.2 rad. Performance: minus the mean distance [m] of the particles to where they are when half the
    sheet hangs on either side, the row that the pickers hold at first beyond the rail; the best is 0. 40 actions of 8
    steps, at most 1 cm per step; in the last 6 of them the pickers are open, whatever the action says: it must hang
    by itself.
    """

    action_repeat = 8
    horizon = 40
    touches_itself = True
    rail_m = (0.3, 0.4, 0.02)  # half length, height, radius
    free_actions = 6

    def _environment(self):
        half, height, radius = self.rail_m
        ground = super()._environment()
        ground.colliders.add(capsule=v1.Capsule(a_m=[-half, height, 0], b_m=[half, height, 0], radius_m=radius))
        return ground

    def _draw_start(self, rng):
        yaw = rng.uniform(-0.2, 0.2) + np.pi * rng.integers(2)
        away = rng.uniform(0.15, 0.25)
        x, _, z = -poses.forward_direction(yaw) * away
        return poses.hanging(x, self.size_m + rng.uniform(0.02, 0.10), z, yaw, self.size_m)

    def _prepare(self, rows, positions):
        super()._prepare(rows, positions)
        if not self._has_begun:
            self._targets = np.zeros((self.num_envs, self.cloths.particles, 3), np.float32)
        _, height, radius = self.rail_m
        middle_m = (positions[:, 0, 0] + positions[:, self.side - 1, 0]) / 2
        turned = np.cos(poses.yaw_of(self._starts[rows])) < 0
        self._targets[rows] = poses.over_rail(middle_m, turned, self.side, self.size_m, height, radius + THICKNESS_M)

    def _advance(self, actions, acts):
        actions = actions.copy()
        actions[self._elapsed >= self._horizon - self.free_actions, 3::4] = 0
        super()._advance(actions, acts)

    def _outlines(self, rows):
        return marks.outline(self._targets[rows], self.side)

    def _performance(self, positions, rows):
        return -metrics.mean_distance(positions, self._targets[rows])
