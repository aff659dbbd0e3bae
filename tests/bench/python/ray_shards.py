"""What Ray costs: actions of DropFlat (16 steps each) by one shard of `drape.gym.shards` beside the same environment without
Ray; and how long shards take to answer again after the death of a server, an actor or a node, with and without a spare."""

import os
import signal
import time

import numpy as np
import ray
from medians import of_median
from ray.cluster_utils import Cluster

from drape.gym import DropFlat
from drape.gym.shards import ShardedVectorEnv

ENVS, ACTIONS, ROUNDS = 64, 10, 25
RECOVERIES, NODES, PATIENCE_S = 5, 4, 120
# victim, spares
LOSSES = [("server", 0), ("actor", 0), ("actor", 1), ("node", 0), ("node", 1)]


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


def processes_of(node):
    """Those of a node of a Cluster, and their children: the raylet, its workers, their servers."""
    parents = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            try:
                parents[int(entry)] = int(open(f"/proc/{entry}/stat").read().rpartition(")")[2].split()[1])
            except OSError:
                pass  # it has just ended
    found = {info.process.pid for infos in node.all_processes.values() for info in infos}
    while more := {pid for pid, parent in parents.items() if parent in found} - found:
        found |= more
    return found


def kill(cluster, sharded, victim):
    """Kills a part of the second shard, as the loss of its machine would."""
    place = sharded.places()[1]
    if victim != "node":
        os.kill(place["server_pid" if victim == "server" else "pid"], signal.SIGKILL)
        return
    node = next(node for node in cluster.list_all_nodes() if node.node_id == place["node"])
    for pid in processes_of(node):
        os.kill(pid, signal.SIGKILL)


def recovery_s(cluster, victim, spares):
    """From the death to the answer to the next action, the second of an episode."""
    end = time.monotonic() + PATIENCE_S
    while ray.available_resources().get("CPU", 0) < NODES:  # what was lost before is back, or made good for
        assert time.monotonic() < end, ray.available_resources()
        time.sleep(0.1)
    actions = np.random.default_rng(1).uniform(-1, 1, (2, ENVS, 8)).astype(np.float32)
    sharded = ShardedVectorEnv(DropFlat, ENVS, shards=2, num_cpus=1, spares=spares, backend="cpu")
    sharded.reset(seed=1)
    sharded.step(actions[0])
    sharded.await_spares()
    kill(cluster, sharded, victim)
    took_s = seconds(sharded, actions[1])
    assert sharded.recoveries
    sharded.close()
    if victim == "node":
        cluster.add_node(num_cpus=1)
    return took_s


def recoveries(is_quick):
    """A row per loss, of two shards on a cluster of four nodes in this machine."""
    # Ray starts its workers at niceness 15: whatever else the machine does would be measured with them.
    os.environ.setdefault("RAY_worker_niceness", "0")
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
    for _ in range(NODES):
        cluster.add_node(num_cpus=1)
    ray.init(address=cluster.address, log_to_driver=False)
    rows = []
    for victim, spares in LOSSES:
        times = [recovery_s(cluster, victim, spares) for _ in range(1 if is_quick else RECOVERIES)]
        rows.append({"victim": victim, "spares": spares, "recoveries": len(times), "median_s": float(np.median(times)),
                     "shortest_s": min(times), "longest_s": max(times)})
    ray.shutdown()
    cluster.shutdown()
    return rows


def overhead(is_quick):
    """One row: `ratio` of the shard to the direct environment with its bounds."""
    ray.init(address="local", num_cpus=2, include_dashboard=False, log_to_driver=False)
    actions = np.random.default_rng(1).uniform(-1, 1, (ACTIONS, ENVS, 8)).astype(np.float32)
    direct, sharded = DropFlat(ENVS, backend="cpu"), ShardedVectorEnv(DropFlat, ENVS, shards=1, num_cpus=2, backend="cpu")
    times = np.array([one_round(direct, sharded, actions) for _ in range(3 if is_quick else ROUNDS)])
    ratio, low, high = of_median(times[:, 1] / times[:, 0])
    direct.close()
    sharded.close()
    ray.shutdown()
    return [{"envs": ENVS, "rounds": len(times), "direct_ms": 1e3 * np.median(times[:, 0]),
            "one_shard_ms": 1e3 * np.median(times[:, 1]), "ratio": ratio, "ratio_95_low": low, "ratio_95_high": high}]
