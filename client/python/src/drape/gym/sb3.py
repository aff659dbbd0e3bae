"""Vector environments of drape.gym for Stable-Baselines3 (extra `sb3`): `StableVecEnv(DropFlat(64,
autoreset_mode="SameStep"))` goes wherever a `VecEnv` does."""

from __future__ import annotations

from drape import extras

extras.need("stable_baselines3", "sb3")

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv


class StableVecEnv(VecEnv):
    """All environments of a gymnasium `VectorEnv`, whose boxes of actions become [-1, 1], as learners want them: its
    limits are -1 and 1 here, the number that closes a picker (above 0.5 of 0 to 1) closes above 0.

    env: an environment with `AutoresetMode.SAME_STEP`, since an SB3 learner takes the observation after the last step
    of an episode for the first of the next; ValueError for others. It is closed with this one. Observations, rewards
    and ends are those of `env`, as copies. Infos are one dict per environment: each number of env's info that is its
    own; at the end of an episode also "terminal_observation", "TimeLimit.truncated", "is_success" (normalized
    performance above `success`) and the numbers of the last step, not of the new start. Seeds: `seed(s)` gives
    environment i the seed s + i from the next reset on.
    """

    def __init__(self, env, *, success: float = 0.9):
        if env.metadata["autoreset_mode"] != AutoresetMode.SAME_STEP:
            raise ValueError(f"env: AutoresetMode.SAME_STEP is needed, got {env.metadata['autoreset_mode']}")
        own = env.single_action_space
        if not isinstance(own, spaces.Box) or not own.is_bounded():
            raise ValueError(f"env: actions in a bounded box are needed, got {own}")
        self.env = env
        self.success = success
        self.render_mode = env.render_mode
        self._middle, self._reach = (own.high + own.low) / 2, (own.high - own.low) / 2
        self._actions = None
        super().__init__(env.num_envs, env.single_observation_space, spaces.Box(-1, 1, own.shape, np.float32))

    def reset(self):
        # SB3 keeps a seed per environment, or None.
        seeds = None if all(seed is None for seed in self._seeds) else list(self._seeds)
        observation, info = self.env.reset(seed=seeds)
        self.reset_infos = self._split(info)
        self._reset_seeds()
        self._reset_options()
        return observation.copy()

    def set_options(self, options=None):
        """Options of the next reset, of which there are none: ValueError for any."""
        if any([options] if isinstance(options, dict) else options or ()):
            raise ValueError(f"options: a reset of all environments has none, got {options}")

    def step_async(self, actions):
        self._actions = self._middle + self._reach * np.clip(actions, -1, 1)

    def step_wait(self):
        observation, rewards, terminated, truncated, info = self.env.step(self._actions.astype(np.float32))
        infos = self._split(info)
        for k in np.flatnonzero(terminated | truncated):
            infos[k].update(_numbers(info["final_info"], k))
            infos[k]["terminal_observation"] = info["final_obs"][k].copy()
            infos[k]["TimeLimit.truncated"] = bool(truncated[k] and not terminated[k])
            if "normalized_performance" in infos[k]:
                infos[k]["is_success"] = bool(infos[k]["normalized_performance"] > self.success)
        return observation.copy(), rewards.astype(np.float32), terminated | truncated, infos

    def close(self):
        self.env.close()

    def get_images(self):
        return list(self.env.render())

    def get_attr(self, attr_name, indices=None):
        """The attribute of the vector environment, once for each index: all environments are one object."""
        return [getattr(self.env, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name, value, indices=None):
        """Sets it for all environments; ValueError for some of them, since they are one object."""
        if len(list(self._get_indices(indices))) != self.num_envs:
            raise ValueError("indices: an attribute belongs to all environments, so None is needed")
        setattr(self.env, attr_name, value)

    def env_method(self, method_name, *arguments, indices=None, **options):
        raise NotImplementedError(f"{method_name}: the environments are one object; call it on .env")

    def env_is_wrapped(self, wrapper_class, indices=None):
        return [False for _ in self._get_indices(indices)]

    def _split(self, info):
        return [_numbers(info, k) for k in range(self.num_envs)]


def _numbers(info, k):
    """The numbers of environment k in a gymnasium vector info."""
    return {name: value[k].item() for name, value in info.items()
            if isinstance(value, np.ndarray) and value.ndim == 1 and not name.startswith("_")}
