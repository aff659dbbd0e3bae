"""Each task can be solved: its scripted policy reaches the stated score on starts that it was not made for."""

import numpy as np
import pytest

from drape.gym import CoverSphere, DropFlat, Flatten, FlingFlat, FoldHalf, Hang, scripted

NUM = 4
SEED = 40_000


def play(task, policy, client, episodes=1, num=NUM, **options):
    """normalized_performance at the end of each episode."""
    env = task(num, client=client, autoreset_mode="Disabled", **options)
    scores = []
    for episode in range(episodes):
        env.reset(seed=SEED + num * episode)
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


# Hang ends in 24 actions, of which the pickers are open in the last 6 in any case.
@pytest.mark.parametrize("task, policy, mean, least, actions, side", [
    (FoldHalf, scripted.fold, 0.90, 0.87, 23, 16),
    (Flatten, scripted.spread, 0.95, 0.80, 38, 12),
    (Hang, scripted.hang, 0.90, 0.85, 25, 16),
])
def test_tasks_of_sheets_that_touch_themselves_too(client, task, policy, mean, least, actions, side):
    """With fewer particles and actions."""
    scores = play(task, policy, client, num=2, side=side, max_episode_steps=actions)
    assert scores.mean() >= mean and scores.min() >= least, scores.round(3)
    assert scores.max() <= 1 + 1e-6


# Crumpled sheets are unlike: Flatten plays more of them.
@pytest.mark.full
@pytest.mark.parametrize("task, policy, num, mean, least", [
    (FoldHalf, scripted.fold, 4, 0.90, 0.87),
    (Flatten, scripted.spread, 10, 0.85, 0.50),
    (Hang, scripted.hang, 4, 0.90, 0.85),
])
def test_tasks_of_sheets_that_touch_themselves_at_their_size(client, task, policy, num, mean, least):
    scores = play(task, policy, client, num=num)
    assert scores.mean() >= mean and scores.min() >= least, scores.round(3)


def test_a_sheet_that_is_not_flat_is_lifted_again(client, monkeypatch):
    env = Flatten(2, client=client, side=8)
    env.reset(seed=7)
    monkeypatch.setattr(env, "_performance", lambda positions, rows: np.array([0.5, 0.95]))
    env._elapsed[:] = 50
    moves = scripted.spread(env).reshape(2, 2, 4)
    assert np.abs(moves[0, :, :3]).max() > 0.1, "to the corners"
    assert not moves[1].any(), "it stays as it is"
    env._elapsed[:] = 50 + 8
    assert scripted.spread(env).reshape(2, 2, 4)[..., 3].tolist() == [[1, 1], [0, 0]]
    env.close()


def test_a_policy_is_as_good_in_the_frame_of_the_start(client):
    options = {"num": 2, "side": 8, "max_episode_steps": 14}
    world, start = (play(DropFlat, scripted.lay_down, client, frame=frame, **options) for frame in ("world", "start"))
    # Motions are rounded to single precision in either frame, 1e-7 of a metre, and contacts spread that.
    assert world.min() > 0.8 and np.abs(world - start).max() < 0.05


def test_in_the_frame_of_the_start_all_starts_are_alike_but_for_their_height(client):
    env = DropFlat(4, client=client, frame="start", side=8)
    observation, _ = env.reset(seed=3)
    places = observation[:, :-2].reshape(4, 27, 3)  # 25 keypoints and two pickers
    assert np.abs(places[:, :, [0, 2]] - places[0, :, [0, 2]].T).max() < 1e-6
    assert np.ptp(places[:, 0, 1]) > 1e-3 and np.allclose(places[:, 25, 0], -0.2) and np.allclose(places[:, 26, 0], 0.2)
    env.step(np.tile(np.float32([0, 0, 1, 1]), (4, 2)))
    assert np.allclose(env._observe()[:, :-2].reshape(4, 27, 3)[:, 25:, 2], 0.16, atol=1e-6)  # 16 steps of 1 cm ahead
    env.close()
    with pytest.raises(ValueError, match="frame"):
        DropFlat(1, client=client, frame="cloth")
    with pytest.raises(ValueError, match="side"):
        DropFlat(1, client=client, side=4)


def test_a_perfect_fold_is_as_far_from_the_best_as_two_layers_are_thick(client):
    env = FoldHalf(2, client=client, side=8)
    env.reset(seed=1)
    folded = env.cloths.positions.astype(float).reshape(2, 8, 8, 3)
    folded[:, :4] = folded[:, :3:-1] + [0, 0.005, 0]
    assert np.allclose(env._performance(folded.reshape(2, 64, 3), np.arange(2)), -0.005)
    # Half a centimetre of the lower half costs 1.2 times as much, and the layers part by it.
    folded[:, 4:] += [0.003, 0, 0.004]
    expected = -np.sqrt(0.005**2 + 0.005**2) - 1.2 * 0.005
    assert np.allclose(env._performance(folded.reshape(2, 64, 3), np.arange(2)), expected)
    assert not env.pickers.holds.any()
    env.close()


def test_a_crumpled_start_is_that_of_its_seed_whatever_the_others_are(client):
    two, one = Flatten(2, client=client, side=8), Flatten(1, client=client, side=8)
    two.reset(seed=7)
    one.reset(seed=8)
    assert np.array_equal(two._positions[1], one._positions[0])
    assert two._measure().max() < 0.95  # it does not lie flat
    assert (two._positions[..., 1].min(1) < 0.01).all() and two._positions[..., 1].max() < 0.3  # and has fallen
    two.close()
    one.close()


def test_what_hangs_over_the_rail_hangs_by_itself(client):
    """The last actions have open pickers, whatever they say."""
    env = Hang(1, client=client, side=8, max_episode_steps=8)
    env.reset(seed=1)
    closed = np.tile(np.float32([0, 0, 0, 1]), (1, 2))
    held = []
    for _ in range(8):
        env.step(closed)
        held.append(int(env.pickers.holds.sum()))
    assert held == [2] * 2 + [0] * 6
    env.close()


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
