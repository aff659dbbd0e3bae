"""Two pickers that hold the corners of a cloth, with SoftGym's convention of actions.

An action has four numbers per picker: a motion, each in [-1, 1], in units of `step_m` per step of the simulation; and a
fourth in [0, 1]: above 0.5 the picker holds, else it lets go. A picker that has let go does not pick up again.
"""

from __future__ import annotations

import numpy as np

from drape import v1

_HOLDS_ABOVE = 0.5


class Pickers:
    """positions: float64[n, k, 3] [m]. holds: bool[n, k]. Held particles are pins, which go where the pickers go."""

    def __init__(self, particles, step_m, low, high):
        self._particles = np.asarray(particles)
        self._step_m = step_m
        self._low, self._high = np.asarray(low), np.asarray(high)
        self._cloths = None
        self.positions = self.holds = None

    @property
    def num(self):
        return len(self._particles)

    def pins(self):
        """The pins that a spec of such a cloth has."""
        return [v1.Pin(particle=int(particle)) for particle in self._particles]

    def attach(self, cloths):
        self._cloths = cloths
        self.positions = np.zeros((cloths.num, self.num, 3))
        self.holds = np.zeros((cloths.num, self.num), bool)

    def begin(self, mask, positions):
        """The cloths of `mask` have just been made: `positions` [m, particles, 3]. All pickers hold."""
        self.positions[mask] = positions[:, self._particles]
        self.holds[mask] = True

    def act(self, actions, mask, steps, duration_s):
        """Takes actions [n, k, 4] for the cloths of `mask`: they happen within the next `steps` steps."""
        lets_go = self.holds & (actions[..., 3] <= _HOLDS_ABOVE) & mask[:, None]
        if lets_go.any():
            self._let_go(lets_go)
        motion = np.clip(actions[..., :3], -1, 1) * (self._step_m * steps)
        moved = np.clip(self.positions + motion, self._low, self._high)
        self.positions[mask] = moved[mask]
        holding = self.holds & mask[:, None]
        if holding.all():
            self._cloths.move_pins(self._particles, self.positions, duration_s)
            return
        for k in range(self.num):
            rows = np.flatnonzero(holding[:, k])
            if len(rows):
                self._cloths.move_pins([self._particles[k]], self.positions[rows, k:k + 1], duration_s, ids=rows)

    def _let_go(self, lets_go):
        self.holds &= ~lets_go
        for row in np.flatnonzero(lets_go.any(1)):
            held = np.flatnonzero(self.holds[row])
            pins = [v1.Pin(particle=int(self._particles[k]), target_m=self.positions[row, k]) for k in held]
            self._cloths.update(v1.ClothSpec(pins=pins), "pins", ids=[row])
