"""A vector environment over many machines: shards that Ray places, each with a server of its own."""

from __future__ import annotations

import functools
import math
import os
import warnings
from typing import Any, NamedTuple

import numpy as np

from drape import extras

extras.need("ray", "ray")

import ray
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

import drape
from drape.gym.vector import ClothVectorEnv, checked_actions, checked_mask, checked_seeds

_NOTICE_S = 0.05  # how often lost shards are looked for while others work


class ShardedVectorEnv(VectorEnv):
    """`num_envs` environments of one task as `shards` Ray actors, each of which owns a `draped`. Spaces, seeds, autoreset and
    results are those of one `task(num_envs)`, bit for bit, wherever the shards are.

    A shard that is lost, with its process or its machine, is made again where Ray has room; one that has lost its server
    alone starts another one. It goes on from the last snapshot that this process has of it, or from the last reset of
    all environments with seeds, and does again what it did since: its state is a function of that, to the bit.
    `replayed` counts what was done again. Snapshots need a device of the same name; on another one the shard goes on
    with a RuntimeWarning, perhaps with other bits. What fails for another reason (a bad action, a bug) is raised.

    task: a class of `drape.gym`, or any callable that makes a vector environment whose `reset` and `step` are repeatable.
    shards: how many, at most num_envs. num_cpus, num_gpus: of each shard, for Ray; its server has as many threads, so
    that shards of one machine do not take the cores from each other, and the GPU that Ray gives to its actor. spares:
    actors that wait to take the place of a lost one, each with as much of the machines as a shard: starting a process
    is most of a recovery. max_recoveries: of all shards in the environment's life, before the error is raised.
    snapshot_every: a shard is asked for a snapshot after so many actions and resets (>= 1), more than which are never done
    again; 64 sheets of 1024 particles take 3 MB here, and less than a tenth of an action. None: never. Then, and if the
    class of what `task` makes has no `snapshot` and `restore` (as wrappers have none), all since the last reset with
    seeds is kept, and done again: reset with seeds now and then. Further arguments are the task's. Needs the extra `ray`
    of this package on all machines, and `ray.init()` before.
    """

    def __init__(self, task, num_envs: int, *, shards: int, num_cpus: float = 1, num_gpus: float = 0,
                 spares: int = 0, max_recoveries: int = 100, snapshot_every: int | None = 5, **arguments):
        if not isinstance(num_envs, (int, np.integer)) or num_envs < 1:
            raise ValueError(f"num_envs: a whole number >= 1, got {num_envs!r}")
        if not (isinstance(shards, (int, np.integer)) and 1 <= shards <= num_envs):
            raise ValueError(f"shards: a whole number, 1 to num_envs ({num_envs}), got {shards!r}")
        if num_gpus > 1:
            raise ValueError(f"num_gpus: a shard's server uses one at most, got {num_gpus}: make more shards")
        if snapshot_every is not None and not (isinstance(snapshot_every, (int, np.integer)) and snapshot_every >= 1):
            raise ValueError(f"snapshot_every: None, or a whole number >= 1, got {snapshot_every!r}")
        self.num_envs = num_envs
        self.replayed = 0
        self.recoveries = 0
        self._max_recoveries = max_recoveries
        self._most_spares = spares
        ends = np.linspace(0, num_envs, shards + 1).round().astype(int)
        self._rows = [slice(begin, end) for begin, end in zip(ends[:-1], ends[1:])]
        if isinstance(task, type) and issubclass(task, ClothVectorEnv) and arguments.get("client") is None:
            arguments.setdefault("threads", max(1, math.ceil(num_cpus)))
        self._arguments = arguments
        self._task = task
        self._actor = ray.remote(num_cpus=num_cpus, num_gpus=num_gpus, max_restarts=0, scheduling_strategy="SPREAD")(_Shard)
        self._shards = [self._make() for _ in range(shards)]
        self._spares: list[_Spare] = []
        # Of each shard, in order: what it was told since the last reset of all with seeds, or a snapshot and that since then.
        self._history: list[list[tuple]] = [[] for _ in range(shards)]
        self._shown: list[tuple] = [()] * shards  # observation and info of each, as last seen
        try:
            (facts, *_) = self._ask([("facts",)] + [None] * (shards - 1))
        except BaseException:
            self.close_extras()
            raise
        self._snapshot_every = snapshot_every if facts["has_snapshots"] else None
        self.metadata = facts["metadata"]
        self.render_mode = facts["render_mode"]
        self.autoreset_mode = AutoresetMode(self.metadata["autoreset_mode"])
        self.single_action_space, self.single_observation_space = facts["spaces"]
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)

    def reset(self, *, seed=None, options=None):
        # Checked here, so that no shard begins while another refuses.
        mask = checked_mask(options, self.num_envs)
        seeds = checked_seeds(seed, self.num_envs)
        if not all(self._history):
            # The first one is of all, and its seeds are drawn here, so that a shard can draw the same again.
            mask = None
            drawn = int(np.random.SeedSequence().generate_state(1)[0])
            seeds = [drawn + k if one is None else one for k, one in enumerate(seeds)]
        others = {name: value for name, value in (options or {}).items() if name != "reset_mask"}
        calls = [("reset", seeds[rows], others if mask is None else {**others, "reset_mask": mask[rows]}) for rows in self._rows]
        if mask is not None:
            calls = [call if mask[rows].any() else None for call, rows in zip(calls, self._rows)]
        answers = self._ask(calls, begins=mask is None and None not in seeds)
        observations, infos = zip(*(_unasked(*self._shown[k]) if answer is None else answer for k, answer in enumerate(answers)))
        self._note(observations, infos)
        self._shorten()
        return np.concatenate(observations), _joined(infos, self._rows)

    def step(self, actions):
        checked_actions(actions, self.action_space.shape)  # here, so that no shard steps while another refuses
        actions = np.asarray(actions)
        answers = self._ask([("step", actions[rows].copy()) for rows in self._rows])
        *columns, infos = zip(*answers)
        self._note(columns[0], infos)
        self._shorten()
        return (*(np.concatenate(column) for column in columns), _joined(infos, self._rows))

    def render(self):
        return tuple(picture for pictures in self._ask([("render",)] * len(self._shards)) for picture in pictures)

    def close_extras(self, **_):
        for actor in self._shards + [spare.actor for spare in self._spares]:
            ray.kill(actor)

    def places(self):
        """Of each shard: the id of its node, and the process ids of its actor and its server."""
        return ray.get([self._begin(k, "place") for k in range(len(self._shards))])

    def await_spares(self):
        """Returns when all spares are ready. Others are made after a recovery, while the shards work."""
        self._ask([("facts",)] * len(self._shards))
        ray.get([spare.is_ready for spare in self._spares])

    # --- parts

    def _make(self):
        return self._actor.remote(self._task, self._arguments)

    def _add_spares(self):
        """Where all shards have their room: Ray may give it to whichever actor waits for it."""
        while len(self._spares) < self._most_spares:
            actor = self._make()
            self._spares.append(_Spare(actor, actor.place.remote(self._rows[0].stop)))

    def _take_spare(self):
        """An actor for a shard: a spare that is ready; else the first one, while others that wait for room are given up, since
        one of them might get it in its place; without spares a new one."""
        ready, _ = ray.wait([spare.is_ready for spare in self._spares], num_returns=len(self._spares), timeout=0) \
            if self._spares else ([], [])
        for spare in self._spares:
            if spare.is_ready in ready:
                self._spares.remove(spare)
                return spare.actor
        waiting, self._spares = self._spares, []
        for spare in waiting[1:]:
            ray.kill(spare.actor)
        return waiting[0].actor if waiting else self._make()

    def _note(self, observations, infos):
        self._shown = list(zip(observations, infos))

    def _shorten(self):
        """Snapshots take the place of histories that have become long."""
        is_long = [self._snapshot_every is not None and _told(history) >= self._snapshot_every for history in self._history]
        if any(is_long):
            self._ask([("snapshot",) if is_long[k] else None for k in range(len(self._shards))])

    def _ask(self, calls, begins=False):
        """Answers of all shards, which work at the same time; those that are lost are recovered meanwhile. No call: None.
        begins: what they were told before does not matter to those that have answered."""
        histories = [[] for _ in calls] if begins else self._history
        answers: list = [None] * len(calls)
        losses = [0] * len(calls)
        failures: dict[int, Exception] = {}
        under_way = {self._begin(k, "do", call): k for k, call in enumerate(calls) if call is not None}
        while under_way:
            ready, _ = ray.wait(list(under_way), num_returns=len(under_way), timeout=_NOTICE_S)
            for future in ready:
                k = under_way.pop(future)
                try:
                    answers[k] = ray.get(future)
                except (ray.exceptions.RayActorError, drape.Unavailable) as error:
                    losses[k] += 1
                    under_way[self._recover(k, histories[k], calls[k], error, losses[k])] = k
                    continue
                except Exception as error:
                    failures[k] = error
                    continue
                if losses[k]:
                    answers[k], other_device = answers[k]
                    self.replayed += _told(histories[k])
                    if other_device:
                        warnings.warn(f"shard {k} goes on with other bits: {other_device}", RuntimeWarning, stacklevel=3)
                if calls[k][0] in ("reset", "step"):
                    histories[k].append(calls[k])
                    self._history[k] = histories[k]
                elif calls[k][0] == "snapshot":
                    self._history[k] = [("restore", answers[k])]
        if None not in calls:
            self._add_spares()
        if failures:
            try:
                raise failures[min(failures)]
            finally:
                del failures  # which would hold this frame, and that itself
        return answers

    def _begin(self, k, method, *arguments):
        rows = self._rows[k]
        return getattr(self._shards[k], method).remote(rows.stop - rows.start, *arguments)

    def _recover(self, k, history, call, error, losses):
        """The future of what shard k did, and of the call: see `do_again`."""
        self.recoveries += 1
        if self.recoveries > self._max_recoveries:
            raise RuntimeError(f"shard {k} was lost once more after {self._max_recoveries} recoveries") from error
        # What has lost its server starts another one; if that fails, too, it may be the machine's fault.
        if losses > 1 or not isinstance(error, drape.Unavailable):
            ray.kill(self._shards[k])
            self._shards[k] = self._take_spare()
        return self._begin(k, "do_again", history, call)


class _Spare(NamedTuple):
    """An actor that waits to take the place of a lost one, and the future that is there once it has a server."""

    actor: Any
    is_ready: Any


class _Shard:
    """The actor: a vector environment and its private server."""

    def __init__(self, task, arguments):
        self._make = functools.partial(task, **arguments)
        # Not made in the constructor: what fails there looks to the owner like a lost actor.
        self._env = None
        self._is_fresh = True

    def place(self, num_envs):
        owned = getattr(self._env_of(num_envs), "_owned", None)
        return {"node": ray.get_runtime_context().get_node_id(), "pid": os.getpid(),
                "server_pid": None if owned is None else owned._connection.server.pid}

    def do(self, num_envs, call):
        env = self._env_of(num_envs)
        self._is_fresh = False
        name, *arguments = call
        if name == "facts":
            # Of the class: a wrapper hands on those of what it wraps, and would forget its own state.
            return {"metadata": env.metadata, "render_mode": env.render_mode,
                    "has_snapshots": hasattr(type(env), "snapshot") and hasattr(type(env), "restore"),
                    "spaces": (env.single_action_space, env.single_observation_space)}
        if name == "snapshot":
            return env.snapshot()
        if name == "reset":
            seeds, options = arguments
            return env.reset(seed=seeds, options=options)
        if name == "step":
            return env.step(arguments[0])
        return env.render()

    def do_again(self, num_envs, history, call):
        """The answer to `call`, and why a snapshot that the history begins with goes on with other bits here, or ""."""
        if not self._is_fresh:
            self._close()
        other_device = ""
        for past in history:
            if past[0] == "restore":
                other_device = self._restore(num_envs, past[1])
            else:
                self.do(num_envs, past)
        return self.do(num_envs, call), other_device

    def _restore(self, num_envs, snapshot):
        env = self._env_of(num_envs)
        self._is_fresh = False
        try:
            env.restore(snapshot)
        except drape.FailedPrecondition as error:
            if error.reason != "OTHER_BUILD":
                raise
            env.restore(snapshot, inexact=True)
            return str(error)
        return ""

    def _env_of(self, num_envs):
        if self._env is not None and self._env.num_envs != num_envs:  # a spare takes the place of a shard of another size
            self._close()
        if self._env is None:
            self._env = self._make(num_envs)
        return self._env

    def _close(self):
        if self._env is not None:
            self._env.close()
        self._env = None
        self._is_fresh = True


def _told(history):
    """How many actions and resets."""
    return sum(name != "restore" for name, *_ in history)


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
