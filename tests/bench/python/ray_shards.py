"""What Ray costs: actions of DropFlat (16 steps each) by one shard of `drape.gym.shards` beside the same environment without
Ray, and how long a killed server takes to be replaced."""

import math
import os
import signal
import time

import numpy as np
import ray

from drape.gym import DropFlat
from drape.gym.shards import ShardedVectorEnv

ENVS, ACTIONS, ROUNDS = 64, 10, 25
RECOVERIES = 5
Z_95 = 1.96  # 95 % of a normal distribution are within so many standard deviations


def seconds(env, action):
    begin = time.perf_counter()
    env.step(action)
    return time.perf_counter() - begin


def one_round(direct, sharded, actions):
    """Times of both, [2]: each action by the one and then by the other, which goes first in turn."""
    for env in (direct, sharded):
        env.reset(seed=1)
        env.step(actions[0])
    total = np.zeros(2)
    for number, action in enumerate(actions):
        for which in (0, 1) if number % 2 else (1, 0):
            total[which] += seconds((direct, sharded)[which], action)
    return total / len(actions)


def of_median(values):
    """The median, and the order statistics within which it is by 95 % whatever the distribution (sign test)."""
    ordered = np.sort(values)
    half_width = Z_95 * math.sqrt(len(ordered)) / 2
    low = max(0, math.floor(len(ordered) / 2 - half_width))
    high = min(len(ordered) - 1, math.ceil(len(ordered) / 2 + half_width))
    return float(np.median(ordered)), float(ordered[low]), float(ordered[high])


def recovery_s(sharded, actions):
    """From the death of the server to the answer to the next action."""
    sharded.reset(seed=1)
    sharded.step(actions[0])
    os.kill(sharded.places()[0]["server_pid"], signal.SIGKILL)
    return seconds(sharded, actions[1])


def measure(is_quick):
    """One row: `ratio` of the shard to the direct environment with its bounds, and the longest recovery."""
    ray.init(address="local", num_cpus=2, include_dashboard=False, log_to_driver=False)
    actions = np.random.default_rng(1).uniform(-1, 1, (ACTIONS, ENVS, 8)).astype(np.float32)
    direct, sharded = DropFlat(ENVS, backend="cpu"), ShardedVectorEnv(DropFlat, ENVS, shards=1, num_cpus=2, backend="cpu")
    times = np.array([one_round(direct, sharded, actions) for _ in range(3 if is_quick else ROUNDS)])
    ratio, low, high = of_median(times[:, 1] / times[:, 0])
    recoveries = [recovery_s(sharded, actions) for _ in range(1 if is_quick else RECOVERIES)]
    direct.close()
    sharded.close()
    ray.shutdown()
    return [{"envs": ENVS, "rounds": len(times), "direct_ms": 1e3 * np.median(times[:, 0]),
             "one_shard_ms": 1e3 * np.median(times[:, 1]), "ratio": ratio, "ratio_95_low": low, "ratio_95_high": high,
             "recovery_s": np.median(recoveries), "longest_recovery_s": max(recoveries)}]
