"""RLlib takes the environments as gymnasium makes them, and makes those that are lost again. `./run test --full` runs
this in build/learning, where PyTorch is."""

import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

pytest.importorskip("ray.rllib", reason="not in build/venv: python_learning_test runs it in build/learning")
import psutil
import ray
from ray.rllib.algorithms.ppo import PPOConfig

from conftest import ROOT

ENVS, HORIZON = 4, 4
WAIT_S = 120


@pytest.fixture(scope="module")
def cluster():
    os.environ.setdefault("RAY_worker_niceness", "0")  # 15 by default: anything else on the machine would go first
    os.environ["RAY_AUTH_MODE"] = "disabled"  # nobody else reaches it, and it would keep a token in the home folder
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    yield
    ray.shutdown()


@pytest.fixture
def algorithm(cluster):
    """PPO with one env runner, a process of its own, which has a server of its own."""
    config = (
        PPOConfig()
        .environment("drape.gym:drape/DropFlat-v0",
                     env_config={"side": 6, "frame": "start", "backend": "cpu", "max_episode_steps": HORIZON})
        .env_runners(num_env_runners=1, num_envs_per_env_runner=ENVS, gym_env_vectorize_mode="vector_entry_point",
                     rollout_fragment_length=2 * HORIZON)
        .fault_tolerance(restart_failed_env_runners=True)
        .training(train_batch_size=2 * HORIZON * ENVS, minibatch_size=16, num_epochs=1))
    algorithm = config.build_algo()
    yield algorithm
    algorithm.stop()
    the_servers(0)  # they end with the processes that have them


def servers():
    """Processes of servers that Ray's processes started. Those of this process belong to other tests."""
    return [one for one in psutil.Process().children(recursive=True)
            if one.name() == "draped" and one.ppid() != os.getpid()]


def the_servers(count):
    """As many as there are to be, soon."""
    end = time.monotonic() + WAIT_S
    while len(found := servers()) != count:
        assert time.monotonic() < end, found
        time.sleep(0.1)
    return found


@pytest.mark.full
def test_rllib_learns_by_vectors_of_environments(algorithm):
    found = algorithm.train()["env_runners"]
    assert found["num_env_steps_sampled"] == 2 * HORIZON * ENVS
    assert found["num_episodes"] == 2 * ENVS and found["episode_len_mean"] == HORIZON
    # Each action costs the mean distance to the target: at most the sheet's diagonal and the height of its start.
    assert -HORIZON * 1.0 < found["episode_return_mean"] < 0


@pytest.mark.full
def test_an_env_runner_whose_server_is_killed_comes_back(algorithm):
    algorithm.train()
    (server,) = the_servers(1)
    server.send_signal(signal.SIGKILL)
    end = time.monotonic() + WAIT_S
    sampled = algorithm.metrics.peek(("env_runners", "num_env_steps_sampled_lifetime"))
    while True:
        found = algorithm.train().get("env_runners", {})
        if found.get("num_env_steps_sampled_lifetime", 0) > sampled and server.pid not in [one.pid for one in servers()]:
            break
        assert time.monotonic() < end, found
    the_servers(1)
    assert np.isfinite(found["episode_return_mean"])


@pytest.mark.full
def test_the_example(cluster):
    example = ROOT / "client/python/examples/rllib_drop_flat.py"
    done = subprocess.run([sys.executable, example, "2", "1", "4", "6"], capture_output=True, text=True, timeout=600,
                          env={**os.environ, "RAY_ADDRESS": "local", "RAY_AUTH_MODE": "disabled"})
    assert done.returncode == 0, done.stderr[-4000:]
    lines = re.findall(r"^(\d): (\d+) actions, return (-[\d.]+) in the mean$", done.stdout, re.M)
    assert [(one, actions) for one, actions, _ in lines] == [("1", "120"), ("2", "240")], done.stdout
