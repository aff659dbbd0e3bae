"""Semantics of gymnasium, compared with its own SyncVectorEnv of one-environment vectors."""

import pathlib

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import drape
from drape.gym import single, vector
from short_task import NUM, Short


@pytest.fixture
def make(client):
    made = []

    def make(mode=AutoresetMode.NEXT_STEP, num=NUM, **options):
        made.append(Short(num, autoreset_mode=mode, client=client, **options))
        return made[-1]

    yield make
    for env in made:
        env.close()


def actions(step, num=NUM):
    rng = np.random.default_rng(step)
    drawn = rng.uniform(-1, 1, (num, 8)).astype(np.float32)
    drawn[:, [3, 7]] = rng.uniform(0.4, 1, (num, 2))  # now and then a picker lets go
    return drawn


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_semantics_are_those_of_gymnasium(client, make, mode):
    env = make(mode)
    theirs = SyncVectorEnv([lambda: single.SingleEnv(Short(1, autoreset_mode=AutoresetMode.DISABLED, client=client))] * NUM,
                           autoreset_mode=mode)
    mine, info = env.reset(seed=11)
    yours, their_info = theirs.reset(seed=11)
    assert np.array_equal(mine, yours)
    assert np.array_equal(info["performance"], their_info["performance"])
    assert info["performance"].dtype == info["normalized_performance"].dtype == np.float64
    for step in range(11):
        mine, *rest, info = env.step(actions(step))
        yours, *their_rest, their_info = theirs.step(actions(step))
        assert np.array_equal(mine, yours), step
        for value, other in zip(rest, their_rest):
            assert np.array_equal(value, other), step
        if mode == AutoresetMode.SAME_STEP and step in (3, 7):
            assert info["_final_obs"].all() and np.array_equal(info["_final_obs"], their_info["_final_obs"])
            assert np.array_equal(info["final_obs"], np.stack(list(their_info["final_obs"])))
            assert np.array_equal(info["final_info"]["performance"], their_info["final_info"]["performance"])
        else:
            assert "final_obs" not in info
    theirs.close()


def test_next_step_mode_ignores_the_action_that_resets(make):
    env = make()
    env.reset(seed=1)
    for step in range(4):
        *_, truncated, _ = env.step(actions(step))
    assert truncated.all()
    _, reward, terminated, truncated, info = env.step(actions(9))
    assert not reward.any() and not terminated.any() and not truncated.any()
    assert np.allclose(info["normalized_performance"], 0) and not env.elapsed.any()


def test_disabled_mode_wants_a_reset_mask(make):
    env = make(AutoresetMode.DISABLED)
    env.reset(seed=1)
    for step in range(4):
        observation, *_ = env.step(actions(step))
    with pytest.raises(RuntimeError, match="reset_mask"):
        env.step(actions(9))
    mask = np.array([False, True, True])
    after, info = env.reset(options={"reset_mask": mask})
    assert np.array_equal(after[0], observation[0]) and not np.array_equal(after[1], observation[1])
    assert info["_performance"].tolist() == mask.tolist()
    env.reset(options={"reset_mask": ~mask})
    assert env.step(actions(9))[0].shape == env.observation_space.shape


@pytest.mark.parametrize("mask, error", [
    (np.zeros(NUM, bool), ValueError), (np.ones(NUM + 1, bool), ValueError), (np.ones(NUM, int), TypeError),
    ([True] * NUM, TypeError)])
def test_bad_masks_are_refused(make, mask, error):
    env = make()
    env.reset(seed=1)
    with pytest.raises(error, match="reset_mask"):
        env.reset(options={"reset_mask": mask})


def test_a_misspelled_option_is_refused(make):
    """Ignored, it would begin all episodes."""
    env = make()
    env.reset(seed=1)
    env.step(actions(0))
    with pytest.raises(ValueError, match="options: a reset has no option 'mask'; it has 'reset_mask'"):
        env.reset(options={"mask": np.array([False, True, True])})
    assert env.elapsed.tolist() == [1] * NUM
    env.reset(options={})


def test_seeds_are_per_environment(make):
    env = make()
    first, _ = env.reset(seed=5)
    second, _ = env.reset()
    assert not np.array_equal(first, second)
    again, _ = env.reset(seed=5)
    assert np.array_equal(first, again)
    assert np.array_equal(env.reset()[0], second)
    assert np.array_equal(env.reset(seed=[7, 6, 5])[0][[2, 1]], first[[0, 1]])
    assert len(np.unique(first, axis=0)) == NUM
    for bad in ([1], -1, 1.5, "a", [1, -2, 3]):
        with pytest.raises(ValueError, match="seed"):
            env.reset(seed=bad)
    with pytest.raises(TypeError, match="options: a dict, got int"):
        env.reset(options=3)


def test_an_episode_has_the_same_bits_alone_and_after_letting_go(make):
    env, alone = make(), make(num=1)

    def episode(env, num, pick=0):
        seen = [env.reset(seed=21 - pick)[0]]
        for step in range(4):
            seen.append(env.step(actions(step)[:num])[0])
        return np.stack(seen)[:, pick if num > 1 else 0]

    first = episode(env, NUM)
    assert np.array_equal(first, episode(env, NUM))
    assert not env.pickers.holds.all()  # somebody has let go: the second episode began with pins again
    assert np.array_equal(first, episode(alone, 1))


@pytest.fixture
def calls(client, monkeypatch):
    """Names of the requests from now on."""
    made, run = [], client._connection._ask
    monkeypatch.setattr(client._connection, "_ask", lambda of, call, tries: made.append(call.method) or run(of, call, tries))
    return made


HOLD = np.tile(np.float32([0.1, -0.2, 0.3, 1]), (NUM, 2))


def test_one_step_per_step(make, calls):
    env = make()
    env.reset(seed=1)
    calls.clear()
    for _ in range(9):  # two episodes end, and two begin
        env.step(HOLD)
    assert calls == ["Step"] * 9


def test_one_more_where_some_begin_and_others_act(make, calls):
    env = make()
    env.reset(seed=1)
    env.step(HOLD)
    env.reset(options={"reset_mask": np.array([False, True, False])})
    calls.clear()
    counts = []
    for _ in range(7):
        env.step(HOLD)
        counts.append(len(calls))
    assert calls == ["Step"] * len(calls)
    assert np.diff([0, *counts]).tolist() == [1, 1, 1, 2, 2, 1, 1]


def test_two_steps_where_episodes_end_in_the_same_step(make, calls):
    env = make(AutoresetMode.SAME_STEP)
    env.reset(seed=1)
    calls.clear()
    counts = []
    for _ in range(5):
        env.step(HOLD)
        counts.append(len(calls))
    assert calls == ["Step"] * len(calls)
    assert np.diff([0, *counts]).tolist() == [1, 1, 1, 2, 1]


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_an_episode_whose_cloth_blows_up_ends_and_another_one_begins(make, mode):
    env = make(mode)
    env.reset(seed=1)
    env.cloths.randomise(ids=[1], gravity=[[0, 1e9, 0]])
    _, _, terminated, truncated, _ = env.step(HOLD)
    assert terminated.tolist() == [False, True, False] and not truncated.any()
    env.cloths.randomise(ids=[1], gravity=[[0, -9.81, 0]])
    if mode == AutoresetMode.SAME_STEP:
        assert env.elapsed.tolist() == [1, 0, 1] and not env.cloths.faulted.any()
    observation, _, terminated, _, _ = env.step(HOLD)
    assert env.elapsed.tolist() == ([2, 1, 2] if mode == AutoresetMode.SAME_STEP else [2, 0, 2])
    assert not terminated.any() and not env.cloths.faulted.any() and np.isfinite(observation).all()


def test_actions_are_checked(make):
    env = make()
    with pytest.raises(RuntimeError, match="reset"):
        env.step(actions(0))
    env.reset(seed=1)
    with pytest.raises(ValueError, match="shape"):
        env.step(actions(0)[:2])
    with pytest.raises(ValueError, match="finite"):
        env.step(actions(0) * np.nan)
    with pytest.raises(ValueError, match="numbers of the shape"):
        env.step(actions(0) * 1j)


@pytest.mark.parametrize("name, value", [
    ("observation", "pixels"), ("side", 6.5), ("side", 4), ("max_episode_steps", 0), ("max_episode_steps", 2.5),
    ("render_mode", "human"), ("client", 3), ("num_envs", 0), ("num_envs", 1.5), ("num_envs", True),
    ("autoreset_mode", "sometimes"), ("autoreset_mode", None)])
def test_arguments_are_checked(name, value):
    with pytest.raises((ValueError, TypeError), match=f"{name}: .*got {value!r}"):
        Short(**{"num_envs": 1, name: value})


def test_one_that_could_not_be_made_can_be_closed():
    """As gymnasium 1.1 does when it is collected."""
    Short.__new__(Short).close()


def test_a_private_server_has_the_threads_that_are_asked_for():
    env = Short(1, backend="cpu", threads=1)
    command = pathlib.Path(f"/proc/{env._owned._connection.server.pid}/cmdline").read_text().split("\0")
    env.close()
    assert "--threads=1" in command


def test_pickers_move_in_their_units_and_keep_their_bounds(make):
    env = make()
    env.reset(seed=3)
    before = env.pickers.positions.copy()
    env.step(np.tile(np.float32([1, -0.5, 0, 1]), (NUM, 2)))
    assert np.allclose(env.pickers.positions - before, [0.02, -0.01, 0])
    held = env.cloths.positions[:, [0, 7]]
    assert np.allclose(held, env.pickers.positions, atol=1e-6)
    env.reset(seed=3)
    for _ in range(4):
        env.step(np.tile(np.float32([0, -9, 0, 1]), (NUM, 2)))
    assert np.allclose(env.pickers.positions[..., 1], np.maximum(before[..., 1] - 0.08, 0))


def test_a_picker_that_closes_again_grabs_the_nearest_within_its_radius(make):
    env = make(num=2)
    env.reset(seed=3)
    stay = np.tile(np.float32([0, 0, 0, 1]), (2, 2))
    opened = stay.copy()
    opened[:, 3] = 0
    env.step(stay)
    env.step(opened)
    assert env.pickers.holds.tolist() == [[False, True]] * 2
    # The corner has fallen a little; the picker of the second environment has gone far away meanwhile.
    opened[1, :3] = [0, 1, 0]
    env.step(opened)
    env.pickers.positions[1, 0, 1] += 0.5
    observation, *_ = env.step(stay)
    assert env.pickers.holds.tolist() == [[True, True], [False, True]]
    assert observation[:, -2:].tolist() == [[1, 1], [0, 1]]


def test_particles_as_observation(make):
    env = make(observation="particles")
    observation, _ = env.reset(seed=1)
    assert observation.shape == (NUM, 64 * 3 + 8)
    assert np.array_equal(observation[:, :192].reshape(NUM, 64, 3), env.cloths.positions)


def test_gymnasium_makes_them():
    env = gymnasium.make_vec("drape.gym:drape/DropFlat-v0", num_envs=2, backend="cpu", max_episode_steps=3)
    assert env.num_envs == 2 and env.unwrapped._horizon == 3
    env.reset(seed=1)
    server = env.unwrapped._owned._connection.server.pid
    env.close()
    from test_private_server import is_alive

    assert not is_alive(server)


@pytest.mark.parametrize("asked, expected", [({}, 30), ({"max_episode_steps": 33}, 33), ({"max_episode_steps": 2}, 2)])
def test_a_single_environment_of_gymnasium_has_the_length_that_its_spec_says(asked, expected):
    env = gymnasium.make("drape.gym:drape/DropFlat-v0", backend="cpu", threads=1, side=5, **asked)
    for _ in range(2):
        env.reset(seed=1)
        ends = [env.step(np.zeros(8, np.float32))[3] for _ in range(expected)]
        assert ends == [False] * (expected - 1) + [True]
    assert env.spec.max_episode_steps == expected
    env.close()


@pytest.mark.parametrize("asked, expected", [({}, 30), ({"max_episode_steps": 33}, 33)])
def test_environments_of_gymnasium_have_the_length_that_their_spec_says(asked, expected):
    env = gymnasium.make_vec("drape.gym:drape/DropFlat-v0", num_envs=2, backend="cpu", threads=1, side=5, **asked)
    assert env.spec.max_episode_steps == expected
    env.reset(seed=1)
    ends = [env.step(np.zeros((2, 8), np.float32))[3].tolist() for _ in range(expected)]
    assert ends == [[False] * 2] * (expected - 1) + [[True] * 2]
    env.close()
    again = gymnasium.make_vec(env.spec)
    assert again.spec.max_episode_steps == expected == again.unwrapped._horizon and again.num_envs == 2
    again.close()


def test_what_is_no_task_says_what_it_lacks(client):
    env = vector.ClothVectorEnv(1, client=client, side=5)
    with pytest.raises(NotImplementedError, match="ClothVectorEnv has no _draw_start.., which a task must give"):
        env.reset(seed=1)
    env.close()


def test_gymnasiums_checks_of_a_single_environment(client):
    from gymnasium.utils.env_checker import check_env

    env = single.SingleEnv(Short(1, autoreset_mode=AutoresetMode.DISABLED, client=client))
    check_env(env, skip_render_check=True)
    env.close()


def test_a_single_environment_speaks_of_one(client):
    """Not of the vector environment behind it: a list is an action, the shape is that of its own space, and so is the end."""
    env = single.SingleEnv(Short(1, autoreset_mode=AutoresetMode.DISABLED, client=client))
    env.reset(seed=1)
    for wrong in (np.zeros((1, 8)), [0.0] * 7, 3, None):
        with pytest.raises(ValueError, match=r"action: numbers of the shape \(8,\) are needed"):
            env.step(wrong)
    while not env.step([0.0] * 8)[3]:
        pass
    with pytest.raises(RuntimeError, match=r"the episode has ended: reset\(\) begins the next one"):
        env.step([0.0] * 8)
    env.reset()
    assert not env.step([0.0] * 8)[3]
    env.close()


def test_an_environment_that_cannot_be_made_leaves_no_server(monkeypatch):
    """Whoever keeps the error, as notebooks do, keeps what it refers to."""
    servers, launch = [], drape.launch
    monkeypatch.setattr(drape, "launch", lambda *given, **options: servers.append(launch(*given, **options)) or servers[-1])
    with pytest.raises(drape.InvalidArgument, match="count"):
        Short(10**6, backend="cpu")
    assert servers[0]._connection.server.has_ended()


def test_pictures_come_in_one_request(make, monkeypatch):
    env = make(render_mode="rgb_array")
    env.reset(seed=1)
    asked, tiles = [], env.cloths.render_tiles
    monkeypatch.setattr(env.cloths, "render_tiles", lambda *fields, **options: asked.append(1) or tiles(*fields, **options))
    pictures = env.render()
    assert isinstance(pictures, tuple) and len(asked) == 1
    assert all(picture.shape == (240, 320, 3) and picture.dtype == np.uint8 for picture in pictures)
    assert not np.array_equal(pictures[0], pictures[1])
    assert all((picture[..., 2].astype(int) - picture[..., 0] > 20).sum() > 500 for picture in pictures)  # a blue cloth
    monkeypatch.setattr(vector, "_MOST_PIXELS", 2 * 320 * 240)
    alone = make(num=1, render_mode="rgb_array")
    alone.reset(seed=1)
    again = [*env.render(), *alone.render()]
    assert len(asked) == 3
    for picture, same in zip(again, [*pictures, pictures[0]]):  # but for the rounding of places
        assert np.abs(picture.astype(int) - same).max() <= 2
