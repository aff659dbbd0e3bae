"""Shards on a Ray cluster of two nodes, each with a server of the wheel: the numbers of one environment without Ray."""

import os

import numpy as np
import ray
from ray.cluster_utils import Cluster

from drape.gym import DropFlat
from drape.gym.shards import ShardedVectorEnv

ENVS, ACTIONS = 4, 6
os.environ["RAY_USAGE_STATS_ENABLED"] = "0"  # there is no network


def play(env):
    """Two episodes, the second of which begins by itself."""
    random = np.random.default_rng(1)
    seen = [env.reset(seed=1)[0]]
    for _ in range(ACTIONS):
        observations, rewards, *ends, _ = env.step(random.uniform(-1, 1, (ENVS, 8)).astype(np.float32))
        seen += [observations, rewards, *ends]
    return seen


alone = DropFlat(ENVS, backend="cpu", max_episode_steps=3)
expected = play(alone)
alone.close()
cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
cluster.add_node(num_cpus=1)
ray.init(address=cluster.address, log_to_driver=False)
env = ShardedVectorEnv(DropFlat, ENVS, shards=2, backend="cpu", max_episode_steps=3)
places = env.places()
assert len({place["node"] for place in places}) == 2, places
assert all(map(np.array_equal, play(env), expected))
env.close()
ray.shutdown()
cluster.shutdown()
print(f"two nodes: {ENVS} environments in 2 shards, {ACTIONS} actions, the numbers of one")
