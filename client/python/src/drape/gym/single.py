"""One environment at a time, for `gymnasium.make` and what wants a `gymnasium.Env`: a vector environment of one."""

from __future__ import annotations

import math

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from drape.gym import floor_tasks, tasks


class SingleEnv(gymnasium.Env):
    """The environment number 0 of a vector environment of one. Of one that `gymnasium.make` has made the wrapper TimeLimit
    truncates the episodes, after the task's `horizon` or what `make(max_episode_steps=…)` says (-1: never), which nothing
    else is told: Hang opens its pickers for the end of its horizon all the same."""

    def __init__(self, vector):
        self._vector = vector
        self._made_of = None
        self._has_ended = False
        self.metadata = {**vector.metadata}
        self.metadata.pop("autoreset_mode")
        self.render_mode = vector.render_mode
        self.action_space = vector.single_action_space
        self.observation_space = vector.single_observation_space

    @property
    def spec(self):
        """What `gymnasium.make` made it of; None if it did not."""
        return self._made_of

    @spec.setter
    def spec(self, spec):
        self._made_of = spec
        if spec is not None:
            self._vector._limit = math.inf

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        observation, info = self._vector.reset(seed=seed, options=options)
        self._has_ended = False
        return observation[0], _first(info)

    def step(self, action):
        if self._has_ended:  # what the vector environment says of it names a mask
            raise RuntimeError("the episode has ended: reset() begins the next one")
        action = np.asarray(action)
        if action.shape != self.action_space.shape:
            raise ValueError(f"action: numbers of the shape {self.action_space.shape} are needed, got {action.dtype} of the shape "
                             f"{action.shape}")
        observation, reward, terminated, truncated, info = self._vector.step(action[None])
        self._has_ended = bool(terminated[0] or truncated[0])
        return observation[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]), _first(info)

    def render(self):
        return self._vector.render()[0]

    def close(self):
        self._vector.close()


def _first(info):
    return {name: value[0] for name, value in info.items() if not name.startswith("_")}


def _maker(task):
    def make(**options):
        return SingleEnv(task(1, autoreset_mode=AutoresetMode.DISABLED, **options))

    make.__name__ = task.__name__
    return make


DropFlat, FlingFlat, CoverSphere, FoldHalf, Flatten, Hang = map(
    _maker, (tasks.DropFlat, tasks.FlingFlat, tasks.CoverSphere, floor_tasks.FoldHalf, floor_tasks.Flatten, tasks.Hang))
