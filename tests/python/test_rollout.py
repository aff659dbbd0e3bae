import pickle

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


@pytest.mark.parametrize("ids", [[2, 0], np.array([True, False, True, False])])
def test_ids_choose_the_cloths(session, spec, ids):
    cloths, alone = session.create(spec, count=4), session.create(spec, count=4)
    targets = np.random.default_rng(3).normal(size=(2, 3, 1, 3)) * 0.05
    rows = cloths.rollout(3, steps=2, ids=ids, pins=[5], pin_targets=targets, view=drape.POSITIONS_AND_VELOCITIES)
    for k in range(3):
        alone.move_pins([5], targets[:, k], over_s=2 / 60, ids=ids)
        answer = alone.step(2, ids=ids, view=drape.POSITIONS_AND_VELOCITIES)
        assert bits(rows["positions"][:, k]) == bits(answer.positions)
        assert bits(rows["velocities"][:, k]) == bits(answer.velocities)
    assert cloths.step_count.tolist() == alone.step_count.tolist() == [6, 0, 6, 0]


def test_nothing_chosen_has_no_rows(session, spec):
    cloths = session.create(spec, count=2)
    rows = cloths.rollout(3, ids=[])
    assert rows["positions"].shape == (0, 3, 36, 3) and rows["step_count"].shape == (0, 3)
    assert not cloths.step_count.any()


def test_grips_grab_move_and_let_go(session):
    cloths, alone = (session.create(sheet(max_grips=2), count=3, origins=[[0, 0, 0], [2, 0, 0], [4, 0, 0]]) for _ in range(2))
    ids = [2, 0]
    held = np.array([[[30, -1], [30, -1], [-1, 35], [31, 35], [31, -1]],
                     [[-1, 35], [-1, 35], [-1, 35], [35, -1], [-1, -1]]])  # 35 goes from hand to hand
    targets = np.random.default_rng(4).normal(size=(1, 5, 2, 3)) * 0.05 + [0.5, 0, 0.8]
    cloths.step(3)
    alone.step(3)
    rows = cloths.rollout(5, steps=3, ids=ids, grips=[0, 1], grip_particles=held, grip_targets=targets)
    before = np.full((2, 2), -1)
    for k in range(5):
        now = held[:, k]
        for slot in (0, 1):
            for at, row in enumerate(ids):
                if now[at, slot] < 0 <= before[at, slot]:
                    alone.release([slot], ids=[row])
        for slot in (0, 1):
            for at, row in enumerate(ids):
                if now[at, slot] >= 0 and now[at, slot] != before[at, slot]:
                    alone.grip([slot], particles=[now[at, slot]], ids=[row])
        alone.move_grips([0, 1], targets[:, k], over_s=3 / 60, ids=ids)
        answer = alone.step(3, ids=ids, grips=True)
        assert bits(rows["positions"][:, k]) == bits(answer.positions), k
        assert (answer.grips.particles == now).all()
        before = now
    where = rows["positions"][0, 4, 31] - [4, 0, 0]
    assert np.allclose(where, targets[0, 4, 0], atol=1e-5), "what is held is where the grip is"


def test_one_particle_for_two_grips_is_refused(session):
    cloths = session.create(sheet(max_grips=3))
    with pytest.raises(drape.InvalidArgument, match="grip_particles: 9 is given twice for one cloth"):
        cloths.rollout(2, grips=[0, 1, 2], grip_particles=[[8, 9, -1], [9, -1, 9]])
    assert cloths.rollout(1, grips=[0, 1, 2], grip_particles=[-1, 9, -1])["step_count"] == 1


def test_grips_go_on_holding(session):
    cloths = session.create(sheet(max_grips=1), count=2)
    cloths.grip([0], particles=[35])
    cloths.step()
    targets = [[[[1, 0.1, 1]], [[1, 0.2, 1]]]]
    rows = cloths.rollout(2, grips=[0], grip_targets=targets, view=drape.StateView(particles=[35]))
    assert np.allclose(rows["positions"][:, :, 0], np.array(targets)[:, :, 0], atol=1e-6)


def test_rest_lengths(session, spec):
    cloths, alone = session.create(spec, count=2), session.create(spec, count=2)
    lengths = np.linspace(0.2, 0.1, 3).reshape(1, 3, 1)
    scales = np.array([[1.0, 0.9, 0.8], [1.1, 1.0, 1.0]])
    rows = cloths.rollout(3, steps=2, constraints=[7], rest_lengths=lengths, rest_length_scales=scales)
    for k in range(3):
        alone.set_rest_lengths([7], lengths[:, k], over_s=2 / 60)
        alone.scale_rest_lengths(scales[:, k], over_s=2 / 60)
        assert bits(rows["positions"][:, k]) == bits(alone.step(2).positions)


@pytest.mark.parametrize("kind", ["plain", "transforms", "saved"])
def test_restarts(session, kind):
    cloths, alone = (session.create(sheet(max_grips=1), count=3) for _ in range(2))
    for batch, name in ((cloths, "two"), (alone, "its two")):
        batch.step(2)
        batch.save(name)
        batch.step(2)
    restarts = np.zeros((3, 4), bool)
    restarts[0, 1] = restarts[1, 1] = restarts[2, 3] = restarts[0, 0] = True
    transforms = np.zeros((3, 4, 7))
    transforms[..., 0], transforms[..., 1], transforms[..., 6] = np.arange(3)[:, None], np.arange(4), 1
    held = np.full((3, 4, 1), -1)
    held[0, 1:] = 35  # what it grabs is where the start has it
    more = {"plain": {}, "transforms": {"restart_transforms": transforms}, "saved": {"restart_to": "two"}}[kind]
    rows = cloths.rollout(4, restarts=restarts, grips=[0], grip_particles=held, **more)
    for k in range(4):
        if restarts[:, k].any():
            if kind == "saved":
                alone.load("its two", restarts[:, k])
            else:
                alone.reset(restarts[:, k], transforms=transforms[restarts[:, k], k] if kind == "transforms" else None)
        if k == 1:
            alone.grip([0], particles=[35], ids=[0])
        answer = alone.step()
        assert bits(rows["positions"][:, k]) == bits(answer.positions), k
        assert rows["step_count"][:, k].tolist() == answer.step_count.tolist()


@pytest.mark.parametrize("columns, words", [
    ({"grips": [0]}, "grip_targets"), ({"grip_targets": np.zeros((1, 2, 1, 3))}, "grips"),
    ({"grips": [0], "grip_particles": [[[36], [0]]]}, "-1 to 35"), ({"grips": [0], "grip_particles": 0.5}, "whole"),
    ({"constraints": [0]}, "go together"), ({"restart_to": "x"}, "restarts"), ({"restarts": [[1, 0]]}, "mask"),
    ({"restarts": [[True, False]], "restart_to": "x", "restart_transforms": np.zeros(7)}, "restart_transforms"),
    ({"grips": [1], "grip_particles": [[[3], [0]]]}, "grips: 1 is not below max_grips of the cloths, 1"),
    ({"rest_length_scales": np.ones((2, 2))}, "does not fit"), ({"ids": [5]}, "not one of")])
def test_columns_that_do_not_fit_are_refused_before_a_step(session, columns, words):
    cloths = session.create(sheet(max_grips=1))
    with pytest.raises(drape.InvalidArgument, match=words):
        cloths.rollout(2, **columns)
    assert cloths.step().step_count == [1]


def test_states_that_have_no_room_are_refused_before_a_step(session):
    cloths = session.create(sheet(64), count=2)
    with pytest.raises(drape.ResourceExhausted, match=r"positions of shape \(2, 2147483647, 4096, 3\), 2.11e\+05 GB") as caught:
        cloths.rollout(2**31 - 1)
    assert caught.value.reason == "NO_MEMORY" and isinstance(caught.value, MemoryError)
    assert cloths.step(view=None).step_count.tolist() == [1, 1]


def test_room_is_of_the_type_that_comes(session, reference):
    for of in (session, reference.session()):
        cloths = of.create(sheet(), count=2)
        for encoding in (0, "FLOAT16", "FIXED16"):
            view = drape.StateView(positions=True, velocities=True, encoding=encoding)
            answer, rows = cloths.step(view=view), cloths.rollout(2, view=view)
            nothing = cloths.step(view=view, ids=[])
            for name in ("positions", "velocities"):
                assert getattr(answer, name).dtype == rows[name].dtype == getattr(nothing, name).dtype


@pytest.mark.parametrize("failing", [0, 3, 9])
def test_what_came_before_an_error_is_told(session, spec, failing):
    cloths, alone = session.create(spec, count=2), session.create(spec, count=2)
    lengths = np.full((1, 10, 1), 0.2)
    lengths[0, failing:] = -1  # which only the server refuses
    with pytest.raises(drape.InvalidArgument, match=f"lengths_m.*; {failing} of 10 rows came before") as caught:
        cloths.rollout(10, constraints=[7], rest_lengths=lengths)
    rows = caught.value.rows
    assert set(rows) == ({"positions", "step_count", "time_s", "faulted"} if failing else set())
    expected = alone.rollout(failing, constraints=[7], rest_lengths=lengths[:, :failing]) if failing else {}
    assert all(bits(rows[name]) == bits(expected[name]) for name in rows)
    copy = pickle.loads(pickle.dumps(caught.value))
    assert all(bits(copy.rows[name]) == bits(rows[name]) for name in rows)
    assert cloths.read().step_count.tolist() == [failing, failing]
