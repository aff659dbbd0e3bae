"""Grips: particles grabbed at run time."""

import numpy as np
import pytest

import drape
from conftest import bits, sheet

ORIGINS = [[0, 0, 0], [3, 0, 0]]


@pytest.fixture
def cloths(session):
    """Two sheets that nothing holds, in environments of their own."""
    return session.create(sheet(pins=[], max_grips=2), count=2, origins=ORIGINS)


def test_a_grabbed_particle_moves_with_its_grip_and_falls_when_released(cloths):
    cloths.grip([0, 1], particles=[0, 5])  # at the particles themselves
    cloths.move_grips([0, 1], [[0, 0.1, 0], [1, 0.1, 0]])
    answer = cloths.step(grips=True)
    assert answer.grips.particles.tolist() == [[0, 5], [0, 5]]
    assert np.allclose(answer.grips.positions, [[[0, 0.1, 0], [1, 0.1, 0]]] * 2, atol=1e-6)
    assert np.allclose(answer.positions[:, 0], np.array(ORIGINS) + [0, 0.1, 0], atol=1e-6)
    held = cloths.step(30).positions
    assert np.allclose(held[:, 5, 1], 0.1, atol=1e-6) and (held[:, 35, 1] < 0).all()
    cloths.release([0, 1], ids=[1])
    answer = cloths.step(30, grips=True)
    assert answer.grips.particles.tolist() == [[0, 5], [-1, -1]]
    assert answer.positions[0, 0, 1] == held[0, 0, 1] and answer.positions[1, 0, 1] < -0.5


def test_the_nearest_is_grabbed_within_the_radius_and_keeps_its_offset(cloths):
    near = np.array([[[0.42, 0.05, 0.0]], [[0.42, 0.5, 0.0]]])  # particle 2 is at x = 0.4; the second is too far away
    cloths.grip(0, nearest_to=near, radius_m=0.1)
    cloths.move_grips(0, near + [0, 0.2, 0], over_s=2 / 60)
    answer = cloths.step(2, grips=True)
    assert answer.grips.particles[:, 0].tolist() == [2, -1]
    assert np.allclose(answer.positions[0, 2], [0.4, 0.2, 0], atol=1e-6)


def test_each_cloth_may_hold_its_own_in_its_own_slot(cloths):
    cloths.grip([[0], [1]], particles=[[3], [7]])
    assert cloths.step(grips=True).grips.particles.tolist() == [[3, -1], [-1, 7]]


def test_a_grip_has_the_same_bits_alone_and_beside_others(session, cloths):
    alone = session.create(cloths.spec, origins=ORIGINS[:1])
    for batch in (cloths, alone):
        batch.grip(0, particles=[0])
    cloths.grip(1, particles=[20], ids=[1])
    for _ in range(5):
        assert bits(cloths.step().positions[:1]) == bits(alone.step().positions)


def test_reset_opens_grips(cloths):
    cloths.grip(0, particles=[0])
    cloths.step()
    cloths.reset()
    assert (cloths.step(grips=True).grips.particles == -1).all()


def test_what_is_wrong_is_said(session, cloths):
    with pytest.raises(drape.InvalidArgument, match="nearest_to and radius_m"):
        cloths.grip(0, nearest_to=[0, 0, 0])
    with pytest.raises(drape.InvalidArgument, match="36 is not below 36"):
        cloths.grip(0, particles=[36])
    cloths.grip(2, particles=[0])
    with pytest.raises(drape.InvalidArgument, match="grip_controls.slots"):
        cloths.step()
    assert cloths.step().step_count.tolist() == [1, 1]
