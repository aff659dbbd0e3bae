"""Snapshots of vector environments: what goes on from one has the bits of what was never interrupted."""

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import drape
from drape import gym as tasks
from short_task import NUM, Short


def actions(step):
    rng = np.random.default_rng(step)
    drawn = rng.uniform(-1, 1, (NUM, 8)).astype(np.float32)
    drawn[:, [3, 7]] = rng.uniform(0.3, 1, (NUM, 2))  # now and then a picker lets go, or grabs again
    return drawn


def numbers(seen):
    """All arrays of an answer, in a row."""
    if isinstance(seen, dict):
        return [array for key in sorted(seen) for array in numbers(seen[key])]
    return [array for part in seen for array in numbers(part)] if isinstance(seen, tuple) else [seen]


def same(a, b):
    return len(numbers(a)) == len(numbers(b)) and all(map(np.array_equal, numbers(a), numbers(b)))


@pytest.fixture
def made():
    made = []
    yield made
    for env in made:
        env.close()


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_episodes_go_on_with_the_same_bits(client, made, mode):
    """From each of nine actions on: amid an episode, at its end, at its begin, when some begin and others act."""
    first, second = (Short(NUM, autoreset_mode=mode, client=client) for _ in range(2))
    made += [first, second]
    mask = np.array([False, True, False])

    def act(env, number):
        if number == 2:
            return env.reset(options={"reset_mask": mask})
        if mode == AutoresetMode.DISABLED and env._done.any():
            return env.reset(options={"reset_mask": env._done.copy()})
        return env.step(actions(number))

    first.reset(seed=4)
    snapshots, seen = [], []
    for number in range(14):
        snapshots.append(first.snapshot())
        seen.append(act(first, number))
    for begin in range(9):
        second.restore(snapshots[begin])
        for number in range(begin, begin + 5):
            assert same(act(second, number), seen[number]), (begin, number)
    assert len(second._session.list()) == NUM, "those from before are gone"


@pytest.mark.parametrize("name", ["DropFlat", "FlingFlat", "CoverSphere", "FoldHalf", "Flatten", "Hang"])
def test_every_task_keeps_what_is_its_own(client, made, name):
    first, second = (getattr(tasks, name)(NUM, side=8, max_episode_steps=2, client=client) for _ in range(2))
    made += [first, second]
    first.reset(seed=4)
    first.step(actions(0))
    second.restore(first.snapshot())
    for number in range(1, 4):
        assert same(second.step(actions(number)), first.step(actions(number))), number


def test_a_snapshot_of_something_else_is_refused(client, made):
    made += [Short(NUM, client=client), Short(2, client=client)]
    for env in made:
        env.reset(seed=1)
    before = made[1].cloths.positions
    with pytest.raises(ValueError, match="snapshot: of .*3.* these are .*2"):
        made[1].restore(made[0].snapshot())
    for other in (b"x", b"", made[0].cloths.snapshot(), made[0].snapshot()[:-5], None):
        with pytest.raises(ValueError, match="snapshot: is not what snapshot"):
            made[1].restore(other)
    assert np.array_equal(before, made[1].cloths.read().positions)


def test_the_number_of_threads_does_not_matter(client, made):
    """The tests' server has one, this one two."""
    made += [Short(NUM, client=client), Short(NUM, backend="cpu", threads=2)]
    first, second = made
    first.reset(seed=1)
    second.restore(first.snapshot())
    for env in made:
        env.cloths.step(20)
    assert np.array_equal(second.cloths.positions, first.cloths.positions)


def test_another_device_has_to_be_accepted(client, made):
    made += [Short(NUM, client=client), Short(NUM, backend="reference")]
    first, second = made
    first.reset(seed=1)
    snapshot = first.snapshot()
    with pytest.raises(drape.FailedPrecondition) as caught:
        second.restore(snapshot)
    assert caught.value.reason == "OTHER_BUILD"
    second.restore(snapshot, inexact=True)
    assert np.abs(second.cloths.positions - first.cloths.positions).max() < 1e-6  # float32, float64
