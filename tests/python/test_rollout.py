import numpy as np
import pytest

import drape
from conftest import bits, sheet


def test_a_rollout_is_its_steps(session, spec):
    cloths, alone = session.create(spec, count=3), session.create(spec, count=3)
    targets = np.random.default_rng(2).normal(size=(3, 6, 2, 3)) * 0.05
    rows = cloths.rollout(6, pins=[0, 5], pin_targets=targets)
    assert rows["positions"].shape == (3, 6, 36, 3)
    for k in range(6):
        alone.move_pins([0, 5], targets[:, k])
        assert bits(rows["positions"][:, k]) == bits(alone.step().positions)
    assert rows["step_count"].tolist() == [[1, 2, 3, 4, 5, 6]] * 3
    assert np.allclose(rows["time_s"][0], np.arange(1, 7) / 60)
    assert not rows["faulted"].any()


def test_targets_are_shared_and_reached_within_a_row(session, spec):
    cloths = session.create(spec, count=2)
    targets = np.zeros((1, 2, 1, 3))
    targets[0, :, 0, 1] = [0.1, 0.2]
    rows = cloths.rollout(2, steps=4, pins=[0], pin_targets=targets)
    assert np.allclose(rows["positions"][:, :, 0, 1], [[0.1, 0.2]] * 2, atol=1e-6)
    assert rows["step_count"].tolist() == [[4, 8]] * 2


def test_targets_are_reached_at_the_time_step_that_the_cloths_have(client, session, spec):
    cloths = session.create(spec, count=2)
    settings = drape.StepSettings(substeps=8, time_step_s=1 / 240)
    cloths.update(drape.ClothSpec(settings=settings), ["settings"])
    assert cloths.spec.settings == settings and cloths.spec.grid == spec.grid
    targets = np.zeros((1, 2, 1, 3))
    targets[0, :, 0, 1] = [0.1, 0.2]
    rows = cloths.rollout(2, steps=4, pins=[0], pin_targets=targets)
    assert np.allclose(rows["positions"][:, :, 0, 1], [[0.1, 0.2]] * 2, atol=1e-6)
    with client.session(name=session.name) as other:  # where nobody has said it
        same = other.attach()
        targets[0, :, 0, 1] = [0.3, 0.1]
        rows = same.rollout(2, steps=4, pins=[0], pin_targets=targets)
        assert np.allclose(rows["positions"][:, :, 0, 1], [[0.3, 0.1]] * 2, atol=1e-6)
    cloths.update(drape.ClothSpec(settings=spec.settings), ["settings"], ids=[1])
    targets[0, :, 0, 1] = [0.0, 0.2]
    rows = cloths.rollout(2, steps=4, pins=[0], pin_targets=targets)
    assert np.allclose(rows["positions"][:, :, 0, 1], [[0, 0.2]] * 2, atol=1e-6)


def test_out_is_filled_again(session, spec):
    cloths = session.create(spec)
    first = cloths.rollout(3, view=drape.POSITIONS_AND_VELOCITIES)
    kept = first["positions"]
    before = bits(kept)
    again = cloths.rollout(3, view=drape.POSITIONS_AND_VELOCITIES, out=first)
    assert again["positions"] is kept and bits(kept) != before
    with pytest.raises(drape.InvalidArgument, match="out"):
        cloths.rollout(4, out=first)
    with pytest.raises(drape.InvalidArgument, match="go together"):
        cloths.rollout(3, pins=[0])


def test_progress_is_shown(session, spec, capsys):
    session.create(sheet()).rollout(3, progress=True)
    assert "3/3" in capsys.readouterr().err
