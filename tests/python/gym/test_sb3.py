"""drape.gym for Stable-Baselines3. `./run test --full` runs this in build/learning, where PyTorch is."""

import csv
import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="not in build/venv: python_learning_test runs it in build/learning")
from stable_baselines3 import PPO

from conftest import ROOT
from drape.gym.sb3 import StableVecEnv
from short_task import NUM, Short


@pytest.fixture
def make(client):
    made = []

    def make(**options):
        made.append(Short(NUM, client=client, **{"autoreset_mode": "SameStep", **options}))
        return made[-1]

    yield make
    for env in made:
        env.close()


@pytest.mark.full
def test_it_gives_what_the_environment_gives(make):
    stable, env = StableVecEnv(make()), make()
    assert stable.num_envs == NUM and stable.action_space.low.min() == -1 and stable.action_space.high.max() == 1
    stable.seed(5)
    first = stable.reset()
    assert np.array_equal(first, env.reset(seed=5)[0]) and stable.observation_space.contains(first[0])
    rng = np.random.default_rng(1)
    for step in range(6):
        actions = rng.uniform(-1.2, 1.2, (NUM, 8)).astype(np.float32)
        inner = np.clip(actions, -1, 1)
        inner[:, [3, 7]] = (inner[:, [3, 7]] + 1) / 2
        observation, rewards, dones, infos = stable.step(actions)
        expected, their_rewards, terminated, truncated, info = env.step(inner)
        assert np.array_equal(observation, expected)
        assert np.array_equal(rewards, their_rewards.astype(np.float32))
        assert np.array_equal(dones, terminated | truncated) and dones.all() == (step == 3)
        for k, own in enumerate(infos):
            source = info["final_info"] if dones[k] else info
            assert own["normalized_performance"] == source["normalized_performance"][k]
            assert dones[k] == ("terminal_observation" in own)
            if dones[k]:
                assert np.array_equal(own["terminal_observation"], info["final_obs"][k])
                assert own["TimeLimit.truncated"] and not own["is_success"]
    # The next reset goes on with the generators, as without seeds.
    assert np.array_equal(stable.reset(), env.reset()[0])


@pytest.mark.full
def test_success_is_a_bar_on_the_performance(make):
    stable = StableVecEnv(make(), success=-1e9)
    stable.reset()
    for _ in range(4):
        *_, infos = stable.step(np.zeros((NUM, 8), np.float32))
    assert all(own["is_success"] for own in infos)


@pytest.mark.full
def test_what_is_not_possible_is_said(make):
    with pytest.raises(ValueError, match="SAME_STEP"):
        StableVecEnv(make(autoreset_mode="NextStep"))
    stable = StableVecEnv(make())
    assert stable.get_attr("size_m", indices=[0, 2]) == [0.4, 0.4] and stable.env_is_wrapped(object) == [False] * NUM
    with pytest.raises(ValueError, match="indices"):
        stable.set_attr("size_m", 1, indices=[1])
    with pytest.raises(NotImplementedError):
        stable.env_method("reset")
    with pytest.raises(ValueError, match="options"):
        stable.set_options([{}, {"reset_mask": True}, {}])
    stable.set_options({})


@pytest.mark.full
def test_a_learner_takes_it(make):
    model = PPO("MlpPolicy", StableVecEnv(make(frame="start")), n_steps=8, batch_size=12, n_epochs=1, seed=1, device="cpu")
    before = [value.clone() for value in model.policy.parameters()]
    model.learn(2 * 8 * NUM)
    assert model.num_timesteps == 2 * 8 * NUM
    assert any((a != b).any() for a, b in zip(before, model.policy.parameters()))


@pytest.mark.full
def test_the_example_learns_and_repeats_itself(tmp_path):
    """A short run with a coarse sheet; the whole one is tests/bench/python/results/ppo_drop_flat.csv."""

    def curve(name, *flags):
        subprocess.run([sys.executable, ROOT / "client/python/examples/ppo_drop_flat.py", tmp_path / name, *flags], check=True)
        with open(tmp_path / f"{name}.csv") as file:
            rows = list(csv.DictReader(file))
        for row in rows:
            del row["wall_s"]
        return rows

    few = "--envs=8", "--side=6", "--steps=500"
    assert curve("a", *few) == curve("b", *few)
    learned = curve("c", "--side=6", "--steps=24000")
    first, last = (float(row["mean"]) for row in (learned[0], learned[-1]))
    # Untrained it is as bad as random actions; three eighths of the way to the policy by hand are far above their noise.
    assert last > max(first, float(learned[0]["random"])) + 0.375 * float(learned[0]["by hand"]), learned
