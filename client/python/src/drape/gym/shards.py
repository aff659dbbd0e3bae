"""A vector environment over many machines: shards that Ray places, each with a server of its own."""

from __future__ import annotations

import functools
import math
import os

import numpy as np

from drape import extras

extras.need("ray", "ray")

import ray
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

import drape
from drape.gym.vector import ClothVectorEnv


class ShardedVectorEnv(VectorEnv):
    """`num_envs` environments of one task as `shards` Ray actors, each of which owns a `draped`. Spaces, seeds, autoreset and
    results are those of one `task(num_envs)`, bit for bit, wherever the shards are.

    A shard that is lost, with its server, its process or its machine, is made again where Ray has room, and does again
    what it did since the last reset of all environments with seeds: its state is a function of that, to the bit. Such a
    reset now and then keeps recovery short; `replayed` counts what was done again. What fails for another reason (a bad
    action, a bug) is raised.

    task: a class of `drape.gym`, or any callable that makes a vector environment whose `reset` and `step` are repeatable.
    shards: how many, at most num_envs. num_cpus, num_gpus: of each shard, for Ray; its server has as many threads, so
    that shards of one machine do not take the cores from each other, and the GPU that Ray gives to its actor. max_recoveries: of all shards in the environment's
    life, before the error is raised. Further arguments are the task's. Needs the extra `ray` of this package on all
    machines, and `ray.init()` before.
    """

    def __init__(self, task, num_envs: int, *, shards: int, num_cpus: float = 1, num_gpus: float = 0,
                 max_recoveries: int = 100, **arguments):
        if not 1 <= shards <= num_envs:
            raise ValueError(f"shards: 1 to num_envs ({num_envs}), got {shards}")
        if num_gpus > 1:
            raise ValueError(f"num_gpus: a shard's server uses one at most, got {num_gpus}: make more shards")
        self.num_envs = num_envs
        self.replayed = 0
        self.recoveries = 0
        self._max_recoveries = max_recoveries
        ends = np.linspace(0, num_envs, shards + 1).round().astype(int)
        self._rows = [slice(begin, end) for begin, end in zip(ends[:-1], ends[1:])]
        if isinstance(task, type) and issubclass(task, ClothVectorEnv) and arguments.get("client") is None:
            arguments.setdefault("threads", max(1, math.ceil(num_cpus)))
        self._arguments = arguments
        self._task = task
        self._actor = ray.remote(num_cpus=num_cpus, num_gpus=num_gpus, max_restarts=0, scheduling_strategy="SPREAD")(_Shard)
        self._shards = [self._make(k) for k in range(shards)]
        # Of each shard, since the last reset of all with seeds: what it was told, in order.
        self._history: list[list[tuple]] = [[] for _ in range(shards)]
        self._shown: list[tuple] = [()] * shards  # observation and info of each, as last seen
        (facts, *_) = self._ask([("facts",)] + [None] * (shards - 1))
        self.metadata = facts["metadata"]
        self.render_mode = facts["render_mode"]
        self.autoreset_mode = AutoresetMode(self.metadata["autoreset_mode"])
        self.single_action_space, self.single_observation_space = facts["spaces"]
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)

    def reset(self, *, seed=None, options=None):
        mask = None if options is None else options.get("reset_mask")
        if seed is None and not all(self._history):
            # The first one: drawn here, so that a shard can draw the same again.
            seed = int(np.random.SeedSequence().generate_state(1)[0])
        seeds = list(seed) if np.ndim(seed) else [None] * self.num_envs if seed is None else [seed + k for k in range(self.num_envs)]
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed: {self.num_envs} are needed, got {len(seeds)}")
        if mask is None and None not in seeds:
            self._history = [[] for _ in self._shards]
        if mask is not None and not np.any(mask):
            raise ValueError("reset_mask: at least one must be True")
        calls = [("reset", seeds[rows], None if mask is None else {**options, "reset_mask": mask[rows]}) for rows in self._rows]
        if mask is not None and all(self._shown):
            calls = [call if mask[rows].any() else None for call, rows in zip(calls, self._rows)]
        answers = self._ask(calls)
        observations, infos = zip(*(_unasked(*self._shown[k]) if answer is None else answer for k, answer in enumerate(answers)))
        self._note(observations, infos)
        return np.concatenate(observations), _joined(infos, self._rows)

    def step(self, actions):
        actions = np.asarray(actions)
        if actions.shape != self.action_space.shape:
            raise ValueError(f"actions: the shape {self.action_space.shape} is needed, got {actions.shape}")
        # Here, so that no shard steps while another refuses.
        if not np.isfinite(actions).all():
            raise ValueError("actions: every number must be finite")
        answers = self._ask([("step", actions[rows].copy()) for rows in self._rows])
        *columns, infos = zip(*answers)
        self._note(columns[0], infos)
        return (*(np.concatenate(column) for column in columns), _joined(infos, self._rows))

    def render(self):
        return tuple(picture for pictures in self._ask([("render",)] * len(self._shards)) for picture in pictures)

    def close_extras(self, **_):
        for shard in self._shards:
            ray.kill(shard)

    def places(self):
        """Of each shard: the id of its node, and the process ids of its actor and its server."""
        return ray.get([shard.place.remote() for shard in self._shards])

    # --- parts

    def _make(self, k):
        rows = self._rows[k]
        return self._actor.remote(self._task, rows.stop - rows.start, self._arguments)

    def _note(self, observations, infos):
        self._shown = list(zip(observations, infos))

    def _ask(self, calls):
        """Answers of all shards, which work at the same time; those that are lost are recovered. No call: None."""
        futures = [None if call is None else shard.do.remote(call) for shard, call in zip(self._shards, calls)]
        answers = []
        for k, call in enumerate(calls):
            if call is None:
                answers.append(None)
                continue
            try:
                answers.append(ray.get(futures[k]))
            except (ray.exceptions.RayActorError, drape.Unavailable) as error:
                answers.append(self._recover(k, call, error))
            if call[0] in ("reset", "step"):
                self._history[k].append(call)
        return answers

    def _recover(self, k, call, error):
        while True:
            self.recoveries += 1
            if self.recoveries > self._max_recoveries:
                raise RuntimeError(f"shard {k} was lost once more after {self._max_recoveries} recoveries") from error
            ray.kill(self._shards[k])
            self._shards[k] = self._make(k)
            try:
                answer = ray.get(self._shards[k].do_again.remote(self._history[k], call))
            except (ray.exceptions.RayActorError, drape.Unavailable) as again:
                error = again
                continue
            self.replayed += len(self._history[k])
            return answer


class _Shard:
    """The actor: a vector environment and its private server."""

    def __init__(self, task, num_envs, arguments):
        self._make = functools.partial(task, num_envs, **arguments)

    @functools.cached_property
    def _env(self):
        # Not in the constructor: what fails there looks to the owner like a lost actor.
        return self._make()

    def place(self):
        owned = getattr(self._env, "_owned", None)
        return {"node": ray.get_runtime_context().get_node_id(), "pid": os.getpid(),
                "server_pid": None if owned is None else owned._connection.server.pid}

    def do(self, call):
        name, *arguments = call
        if name == "facts":
            env = self._env
            return {"metadata": env.metadata, "render_mode": env.render_mode,
                    "spaces": (env.single_action_space, env.single_observation_space)}
        if name == "reset":
            seeds, options = arguments
            return self._env.reset(seed=seeds, options=options)
        if name == "step":
            return self._env.step(arguments[0])
        return self._env.render()

    def do_again(self, history, call):
        for past in history:
            self.do(past)
        return self.do(call)


def _unasked(observation, info):
    """What a shard shows of environments that were not reset."""
    now = {key: value for key, value in info.items() if not key.lstrip("_").startswith("final_")}
    return observation, {key: np.zeros_like(value) if key.startswith("_") else value for key, value in now.items()}


def _joined(infos, rows):
    """The infos of all shards as one. A key that some shards lack is zero there."""
    joined = {}
    for key in dict.fromkeys(key for info in infos for key in info):
        parts = [info.get(key) for info in infos]
        some = next(part for part in parts if part is not None)
        if isinstance(some, dict):
            joined[key] = _joined([{} if part is None else part for part in parts], rows)
            continue
        joined[key] = np.concatenate([
            np.zeros((own.stop - own.start, *some.shape[1:]), some.dtype) if part is None else part
            for part, own in zip(parts, rows)])
    return joined
