"""What Ray costs: actions of DropFlat (16 steps each) by one shard of `drape.gym.shards` beside the same environment without Ray,
in turn, and how long a killed server takes to be replaced. By hand, with client/python/ray.lock installed into build/venv:
`build/venv/bin/python -B tests/bench/python/ray_shards.py`.
"""

import os
import signal
import time

import numpy as np
import ray

from drape.gym import DropFlat
from drape.gym.shards import ShardedVectorEnv

ENVS, ACTIONS, ROUNDS = 64, 10, 5


def seconds(env, actions):
    env.reset(seed=1)
    env.step(actions[0])
    begin = time.perf_counter()
    for action in actions:
        env.step(action)
    return (time.perf_counter() - begin) / len(actions)


def main():
    ray.init(num_cpus=2, log_to_driver=False)
    actions = np.random.default_rng(1).uniform(-1, 1, (ACTIONS, ENVS, 8)).astype(np.float32)
    direct, sharded = DropFlat(ENVS, backend="cpu"), ShardedVectorEnv(DropFlat, ENVS, shards=1, backend="cpu")
    times = np.array([[seconds(direct, actions), seconds(sharded, actions)] for _ in range(ROUNDS)])
    ratio = np.median(times[:, 1] / times[:, 0])
    print(f"{ENVS} environments, ms per action: direct {1e3 * np.median(times[:, 0]):.1f}, one shard {1e3 * np.median(times[:, 1]):.1f}, "
          f"median ratio {ratio:.3f}")
    sharded.reset(seed=1)
    sharded.step(actions[0])
    os.kill(sharded.places()[0]["server_pid"], signal.SIGKILL)
    begin = time.perf_counter()
    sharded.step(actions[1])
    print(f"a killed server: {time.perf_counter() - begin:.2f} s until the next answer, {sharded.replayed} calls done again")


if __name__ == "__main__":
    main()
