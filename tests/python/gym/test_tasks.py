"""Each task can be solved: its scripted policy reaches the stated score on starts that it was not made for."""

import numpy as np
import pytest

from drape.gym import CoverSphere, DropFlat, FlingFlat, scripted

NUM = 4
SEED = 40_000


def play(task, policy, client, episodes=1, **options):
    """normalized_performance at the end of each episode."""
    env = task(NUM, client=client, autoreset_mode="Disabled", **options)
    scores = []
    for episode in range(episodes):
        env.reset(seed=SEED + NUM * episode)
        for _ in range(env._horizon):
            _, rewards, terminated, truncated, info = env.step(policy(env))
        assert truncated.all() and not terminated.any()
        assert np.allclose(rewards, info["performance"])
        scores.append(info["normalized_performance"])
    env.close()
    return np.concatenate(scores)


@pytest.mark.parametrize("task, policy, mean, least, actions", [
    (DropFlat, scripted.lay_down, 0.96, 0.93, 14),
    (FlingFlat, scripted.fling, 0.90, 0.70, 40),
    (CoverSphere, scripted.cover, 0.99, 0.95, 14),
])
@pytest.mark.parametrize("is_long", [False, pytest.param(True, marks=pytest.mark.full)])
def test_the_scripted_policy_reaches_its_score(client, task, policy, mean, least, actions, is_long):
    """`actions`: in the short tier an episode ends when the policy has done its work."""
    scores = (play(task, policy, client, episodes=10) if is_long
              else play(task, policy, client, max_episode_steps=actions))
    assert scores.mean() >= mean and scores.min() >= least, scores.round(3)
    assert scores.max() <= 1 + 1e-6


def test_doing_nothing_scores_nothing(client):
    def still(env):
        return np.tile(np.float32([0, 0, 0, 1]), (NUM, 2))

    assert np.abs(play(DropFlat, still, client, max_episode_steps=5)).max() < 0.05  # it swings a little


def test_letting_go_at_once_scores_little(client):
    def open_(env):
        return np.zeros((NUM, 8), np.float32)

    scores = play(FlingFlat, open_, client, max_episode_steps=15)
    assert scores.max() < 0.6


def test_targets_are_reached_by_the_same_sheet(client):
    """The target of DropFlat is an isometric place of the sheet on the floor."""
    env = DropFlat(2, client=client)
    env.reset(seed=1)
    grid = env._targets.reshape(2, 32, 32, 3)
    step = env.size_m / 31
    for axis in (1, 2):
        lengths = np.linalg.norm(np.diff(grid, axis=axis), axis=-1)
        assert np.allclose(lengths, step, rtol=1e-4)
    lowest = env.cloths.positions.reshape(2, 32, 32, 3)[:, -1]
    assert np.allclose(lowest[..., [0, 2]], grid[:, -1][..., [0, 2]], atol=1e-5)
    env.close()
