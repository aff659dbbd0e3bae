"""DropFlat in shards wherever Ray has room, each with a server of its own; one of the servers is killed on the way.

ray_shards.py [ENVS [SHARDS]]. On this machine alone, unless RAY_ADDRESS names a cluster (extra `ray`).
"""

import os
import signal
import sys

import ray

from drape.gym import DropFlat
from drape.gym.shards import ShardedVectorEnv

envs, shards = (int(text) for text in (sys.argv[1:] + ["64", "2"][len(sys.argv) - 1:]))
ray.init()
env = ShardedVectorEnv(DropFlat, envs, shards=shards)
for shard, place in enumerate(env.places()):
    print(f"shard {shard} is on node {place['node'][:8]}, its server is process {place['server_pid']}")
observations, info = env.reset(seed=1)
env.action_space.seed(1)
for number in range(6):
    if number == 3:
        os.kill(env.places()[0]["server_pid"], signal.SIGKILL)  # of a cluster: ssh there, or end its machine
    observations, rewards, terminated, truncated, info = env.step(env.action_space.sample())
    print(f"action {number}: rewards of {rewards.mean():+.4f} in the mean, {env.recoveries} recoveries")
env.close()
