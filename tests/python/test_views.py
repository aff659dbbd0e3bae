"""Encodings and reductions of views: against what the plain states of the same step say."""

import numpy as np
import pytest

import drape
from conftest import bits, sheet
from drape import StateView
from drape.gym import metrics

REDUCTIONS = [StateView.COVERAGE, StateView.CENTROID, StateView.BOX, StateView.TARGET_DISTANCE]
ORIGINS = [[0, 0, 0], [40, 0, -7.5]]


@pytest.fixture(params=["client", "reference"])
def falling(request):
    """Two cloths in environments of their own, on their way."""
    with request.getfixturevalue(request.param).session() as session:
        cloths = session.create(sheet(), count=2, origins=ORIGINS)
        cloths.step(20)
        yield cloths


def viewed(cloths, view):
    """The answer to a step with this view, and the plain states of the same step."""
    answer = cloths.step(view=view)
    return answer, cloths.read(velocities=True)


def test_float16_is_within_2_to_minus_11_in_the_environment(falling):
    answer, exact = viewed(falling, StateView(positions=True, velocities=True, encoding=StateView.FLOAT16))
    assert answer.positions.dtype == answer.velocities.dtype == np.float16
    assert answer.origins.tolist() == ORIGINS
    local = exact.positions - np.array(ORIGINS)[:, None]
    rounding = np.finfo(exact.positions.dtype).eps * 64  # of the world's numbers, which the bound does not cover
    assert (np.abs(answer.positions - local) <= np.maximum(np.abs(local) * 2.0**-11, 2.0**-25) + rounding).all()
    speeds = exact.velocities.astype(np.float64)
    assert (np.abs(answer.velocities - speeds) <= np.maximum(np.abs(speeds) * 2.0**-11, 2.0**-25)).all()
    assert np.abs(speeds).max() > 0.01


def test_fixed16_is_within_half_a_step_of_the_box(falling):
    answer, exact = viewed(falling, StateView(positions=True, velocities=True, encoding=StateView.FIXED16))
    assert answer.positions.dtype == np.float32 and answer.velocities.dtype == np.float16
    sides = np.ptp(exact.positions.astype(np.float64), axis=1).max(1)
    error = np.abs(answer.positions.astype(np.float64) - exact.positions).max((1, 2))
    assert (error <= sides / 131068 + np.finfo(np.float32).eps * 64).all()
    assert (error > 0).all()
    rows = falling.step(view=StateView(positions=True, particles=[0, 5, 30], encoding=StateView.FIXED16)).positions
    assert np.allclose(rows, falling.positions[:, [0, 5, 30]], atol=3e-5) and rows.shape == (2, 3, 3)


def test_reductions_are_those_of_all_particles(falling):
    target = np.random.default_rng(4).normal(size=(falling.particles, 3))
    view = StateView(reductions=REDUCTIONS, target_m=drape.pack(target), coverage_radius_m=0.03, positions=True,
                     particles=[3, 7])
    answer, exact = viewed(falling, view)
    positions = exact.positions.astype(np.float64)
    eps = np.finfo(exact.positions.dtype).eps * 64
    assert np.allclose(answer.centroid, positions.mean(1), atol=eps, rtol=0)
    assert np.allclose(answer.box, np.stack([positions.min(1), positions.max(1)], 1), atol=eps, rtol=0)
    local = positions - np.array(ORIGINS)[:, None]
    assert np.allclose(answer.target_distance, metrics.mean_distance(local, target), atol=eps, rtol=0)
    assert np.allclose(answer.coverage, metrics.coverage(local, 0.03), rtol=1e-2) and (answer.coverage > 0).all()
    assert bits(answer.positions) == bits(exact.positions[:, [3, 7]])


def test_reductions_alone_bring_no_positions(falling):
    answer = falling.step(view=StateView(reductions=[StateView.CENTROID]), ids=[1])
    assert answer.positions is None and answer.box is None and answer.centroid.shape == (1, 3)
    rows = falling.rollout(3, view=StateView(reductions=[StateView.BOX]))
    assert rows["box"].shape == (2, 3, 2, 3) and "positions" not in rows


def test_what_is_encoded_is_not_taken_for_the_state(falling):
    answer = falling.step(view=StateView(encoding=StateView.FLOAT16))
    assert falling.positions.dtype == falling._session.dtype != answer.positions.dtype


def test_the_view_changes_no_bits(falling):
    batch, other = (falling._session.create(sheet(), count=2, origins=ORIGINS) for _ in range(2))
    for _ in range(5):
        batch.step(view=StateView(reductions=[StateView.BOX], encoding=StateView.FIXED16, positions=True))
        other.step(view=None)
    assert bits(batch.positions) == bits(other.positions)


def test_what_does_not_fit_is_named(falling):
    before = falling.step_count.tolist()
    for view, field in ((StateView(reductions=[StateView.COVERAGE]), "view.coverage_radius_m"),
                        (StateView(reductions=[StateView.BOX] * 2), "view.reductions[1]"),
                        (StateView(reductions=[StateView.TARGET_DISTANCE], target_m=drape.pack(np.zeros((2, 3)))),
                         "view.target_m.shape")):
        with pytest.raises(drape.InvalidArgument) as caught:
            falling.step(view=view)
        assert [violation.field for violation in caught.value.fields] == [field]
    assert falling.step_count.tolist() == before
