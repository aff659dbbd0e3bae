"""Pickers that hold particles of a cloth, with SoftGym's convention of actions.

An action has four numbers per picker: a motion, each in [-1, 1], in units of `step_m` per step of the simulation; and a
fourth in [0, 1]: above 0.5 the picker closes, else it is open. One that closes grabs the nearest particle within
`radius_m` that the other does not hold, if there is one.
"""

from __future__ import annotations

import numpy as np

_CLOSES_ABOVE = 0.5


class Pickers:
    """positions: float64[n, k, 3] [m]. holds: bool[n, k]. Pickers are the grips of the cloths."""

    def __init__(self, particles, step_m, radius_m, low, high):
        self._particles = np.asarray(particles)
        self._slots = np.arange(len(self._particles))
        self._step_m = step_m
        self._radius_m = radius_m
        self._low, self._high = np.asarray(low), np.asarray(high)
        self._cloths = None
        self.positions = self.holds = None

    @property
    def num(self):
        return len(self._particles)

    def attach(self, cloths):
        """They are the grips of `cloths`, and stay where they are if they are anywhere yet."""
        self._cloths = cloths
        if self.positions is None:
            self.positions = np.zeros((cloths.num, self.num, 3))
            self.holds = np.zeros((cloths.num, self.num), bool)

    def __getstate__(self):  # cloths belong to a server
        return {**vars(self), "_cloths": None}

    def begin(self, rows, positions):
        """The cloths `rows` have just been reset: `positions` [m, particles, 3]. Each picker holds its particle."""
        self.positions[rows] = positions[:, self._particles]
        self.holds[rows] = True
        self._cloths.grip(self._slots, particles=self._particles, at=self.positions[rows], ids=rows)

    def begin_open(self, rows, places):
        """The cloths `rows` have just been reset: the pickers are at places [m, k, 3] and hold nothing."""
        self.positions[rows] = places
        self.holds[rows] = False

    def act(self, actions, mask, steps, duration_s):
        """Takes actions [n, k, 4] for the cloths of `mask`, their motions in the world and within the limits: they
        happen within the next `steps` steps."""
        closes = actions[..., 3] > _CLOSES_ABOVE
        moved = np.clip(self.positions + actions[..., :3] * (self._step_m * steps), self._low, self._high)
        for k in self._slots:
            grabs = np.flatnonzero(mask & closes[:, k] & ~self.holds[:, k])
            if len(grabs):
                self._cloths.grip(k, nearest_to=self.positions[grabs, k:k + 1], radius_m=self._radius_m, ids=grabs)
            opens = np.flatnonzero(mask & ~closes[:, k] & self.holds[:, k])
            if len(opens):
                self._cloths.release(k, ids=opens)
        self.positions[mask] = moved[mask]
        rows = np.flatnonzero(mask)
        self._cloths.move_grips(self._slots, self.positions[rows], duration_s, ids=rows)

    def note(self, rows, grips):
        """What the grips of the cloths `rows` hold after a step."""
        self.holds[rows] = grips.particles[:, :self.num] >= 0
