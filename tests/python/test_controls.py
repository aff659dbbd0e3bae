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


def test_one_particle_for_two_grips_is_refused(cloths):
    """One of them would stay open without a word. Of two cloths each has its own."""
    with pytest.raises(drape.InvalidArgument, match="particles: 7 is given twice for one cloth"):
        cloths.grip([0, 1], particles=[[6, 7], [7, 7]])
    cloths.grip(0, particles=[[7], [7]])
    assert cloths.step(grips=True).grips.particles.tolist() == [[7, -1]] * 2


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


def test_a_grip_opens_when_it_is_pulled_too_hard(cloths):
    cloths.grip(0, particles=[0], largest_force_n=[[0.01], [100.0]])  # 0.2 kg/m^2
    assert cloths.step(20, grips=True).grips.particles[:, 0].tolist() == [-1, 0]
    cloths.grip(0, nearest_to=np.zeros((2, 1, 3)), radius_m=10, largest_force_n=-1)
    with pytest.raises(drape.InvalidArgument, match="largest_forces_n"):
        cloths.step()


def test_a_grip_with_a_limit_is_the_same_after_a_snapshot(session, cloths):
    cloths.grip(0, particles=[0], largest_force_n=[[1.0], [1e6]])
    cloths.step(3)
    copies = session.restore(cloths.snapshot())
    assert (cloths.step(grips=True).grips.particles[:, 0] == 0).all()
    copies.step()
    for batch in (cloths, copies):
        batch.move_grips(0, np.array([[[0, 3, 0]]] * 2), over_s=0.1)
        answer = batch.step(12, grips=True)
        assert answer.grips.particles[:, 0].tolist() == [-1, 0]


def test_reset_opens_grips(cloths):
    cloths.grip(0, particles=[0])
    cloths.step()
    cloths.reset()
    assert (cloths.step(grips=True).grips.particles == -1).all()


def test_a_restart_is_a_reset_and_a_step_in_one_request(session, spec):
    one, two = session.create(spec, count=4), session.create(spec, count=4)
    transforms = [[0.1, 1, 0, 0, 0.6, 0, 0.8], [0.2, 1, 0, 0, 0, 0, 1]]
    overrides = [drape.ClothOverride(damping_per_s=0.5), drape.ClothOverride(damping_per_s=2)]
    for cloths in (one, two):
        cloths.step(5)
        cloths.move_pins([0], [9, 9, 9], ids=[2])  # forgotten
    one.restart([3, 1], transforms=transforms, overrides=overrides)
    one.restart([2], transforms=[[0, 2, 0, 0, 0, 0, 1]], overrides=[drape.ClothOverride()])
    one.move_pins([0], [0, 0.1, 0], ids=[3])
    assert one.step_count.tolist() == [5, 5, 5, 5], "nothing has happened yet"
    assert one.step(2, ids=[0]).step_count.tolist() == [7]
    answer = one.step(2, expected=7)
    two.reset([3, 1], transforms=transforms, overrides=overrides)
    two.reset([2], transforms=[[0, 2, 0, 0, 0, 0, 1]])
    two.move_pins([0], [0, 0.1, 0], ids=[3])
    two.step(2, ids=[0])
    assert answer.step_count.tolist() == two.step(2).step_count.tolist() == [9, 2, 2, 2]
    assert bits(one.positions) == bits(two.positions)
    assert one.step().step_count.tolist() == [10, 3, 3, 3], "once"


def test_a_restart_goes_on_from_what_was_saved(session, spec):
    one, two = session.create(spec, count=3), session.create(spec, count=3)
    for cloths, name in ((one, "three"), (two, "3")):
        for row in range(3):
            cloths.move_pins([0], [0, 0.1 * row, 0], ids=[row])
        cloths.step(3)
        cloths.save(name)
        cloths.step(4)
    one.save("seven")
    one.restart([0, 2], to="three", of=[1, 2])
    assert one.step(2).step_count.tolist() == [5, 9, 5]
    two.load("3", [0, 2], of=[1, 2])
    two.step(2)
    assert bits(one.positions) == bits(two.positions)
    one.restart(to="three")
    with one.pipeline(depth=1) as steps:
        assert steps.step().step_count.tolist() == [4, 4, 4]
    two.load("3")
    assert bits(one.positions) == bits(two.step(1).positions)
    one.restart([0], to="three")
    with pytest.raises(drape.InvalidArgument, match="to: 'seven', but cloths that wait .* from 'three'"):
        one.restart([1], to="seven")
    one.reset()  # forgets it
    one.restart([1], to="seven")
    assert one.step().step_count.tolist() == [1, 8, 1]
    one.restart(to="nothing")
    with pytest.raises(drape.NotFound, match="SAVED_STATES_NOT_FOUND"):
        one.step()
    assert one.step().step_count.tolist() == [2, 9, 2], "the refused one did nothing, and is gone"


def test_restarts_that_do_not_go_together_are_refused(session, spec):
    cloths = session.create(spec, count=3)
    cloths.restart([], to="x")
    cloths.restart(np.zeros(3, bool))
    assert cloths.step().step_count.tolist() == [1, 1, 1]
    cloths.restart([0])
    for arguments, words in ((dict(transforms=[0, 0, 0, 0, 0, 0, 1]), "transforms: cloths that wait"),
                             (dict(transforms=[0, 1]), "does not fit"), (dict(overrides=[]), "overrides: has 0 elements, 1 are"),
                             (dict(overrides=[3]), "overrides: "), (dict(of=[0]), "of: goes with"),
                             (dict(to="x", overrides=[drape.ClothOverride()]), "to: goes without"),
                             (dict(to=3), "name: 3 is not a text"), (dict(to="x", of=[3]), "of: index 3")):
        with pytest.raises(drape.InvalidArgument, match=words):
            cloths.restart([1], **arguments)
    assert cloths.step().step_count.tolist() == [1, 2, 2]
    others = session.create(spec)
    cloths.restart(to="a")
    others.restart(to="b")
    with pytest.raises(drape.InvalidArgument, match=r"to: cloths of one step go on from one name, got \['a', 'b'\]"):
        session.step([cloths, others])


def test_what_is_wrong_is_said(session, cloths):
    with pytest.raises(drape.InvalidArgument, match="nearest_to and radius_m"):
        cloths.grip(0, nearest_to=[0, 0, 0])
    with pytest.raises(drape.InvalidArgument, match="36 is not below 36"):
        cloths.grip(0, particles=[36])
    attached = session.attach(cloths.ids)
    attached.grip(2, particles=[0])
    with pytest.raises(drape.InvalidArgument, match="grip_controls.slots"):
        attached.step()
    assert cloths.step().step_count.tolist() == [1, 1]


def test_forces_of_grips_carry_the_weight(session):
    """Of a sheet that hangs at rest by one corner; the other grip is open."""
    density = 0.2
    material = drape.Material(areal_density_kg_per_m2=density, damping_per_s=4)
    cloths = session.create(sheet(pins=[], max_grips=2, material=material), count=2)
    cloths.grip(0, particles=[0])
    cloths.step(900, view=None)
    with pytest.raises(drape.FailedPrecondition, match="impulses=True"):
        cloths.step(grips=True).grips.forces(1 / 60)
    answer = cloths.step(impulses=True)
    assert bits(answer.grips.impulses) == bits(answer.impulses.grips)
    forces = answer.grips.forces(cloths.describe(0).settings.time_step_s)
    assert np.allclose(forces[:, 0], [0, -9.81 * density, 0], atol=0.02) and (forces[:, 1] == 0).all()


def test_grips_of_cloths_with_unlike_numbers_are_each_in_its_row_and_slot(session):
    batches = [session.create(sheet(pins=[], max_grips=grips)) for grips in (2, 4, 0)]
    batches[1].grip([0, 1, 2, 3], particles=[20, 21, 22, 23])
    batches[0].grip([0, 1], particles=[10, 11])
    for batch in batches:
        batch.step()
    mixed = session.attach(np.concatenate([batch.ids for batch in batches]))
    answer = mixed.step(impulses=True)
    assert answer.grips.particles.tolist() == [[10, 11, -1, -1], [20, 21, 22, 23], [-1] * 4]
    assert not answer.grips.positions[0, 2:].any() and answer.grips.positions[1, 3, 0] == pytest.approx(1, abs=1e-6)
    assert bits(answer.grips.impulses) == bits(answer.impulses.grips)
    assert answer.impulses.grips.shape == (3, 4, 3)
    for row, held in ((0, 2), (1, 4), (2, 0)):
        assert answer.impulses.grips[row, :held].any(-1).all() and not answer.impulses.grips[row, held:].any()
    some = mixed.step(impulses=True, ids=[1, 0]).grips
    assert some.particles.tolist() == [[20, 21, 22, 23], [10, 11, -1, -1]]
    assert mixed.step(grips=True, ids=[2]).grips.particles.shape == (1, 0)


def refused(cloths, error):
    """A step that the server refuses by this error."""

    def ask(connection, of, call, tries):
        raise error

    with pytest.MonkeyPatch.context() as patch, pytest.raises(type(error)):
        patch.setattr("drape.connection.Connection._ask", ask)
        cloths.step()


@pytest.mark.parametrize("ask, kind", [
    (lambda cloths: cloths.step(expected=7), drape.FailedPrecondition),
    (lambda cloths: cloths.step(timeout_s=-1), drape.InvalidArgument),  # not sent
    (lambda cloths: cloths.step(view=drape.StateView(reductions=[drape.StateView.COVERAGE])), drape.InvalidArgument),
    (lambda cloths: cloths._session.step([cloths], expected=7), drape.FailedPrecondition),
    (lambda cloths: refused(cloths, drape.ResourceExhausted(reason="QUEUE_FULL")), None),
    (lambda cloths: refused(cloths, drape.Cancelled(reason="DEADLINE_PASSED")), None)])
def test_controls_wait_on_where_a_step_was_not_begun(session, ask, kind):
    cloths = session.create(sheet(max_grips=1), count=2)
    cloths.move_pins([0], [0, 0.25, 0])
    cloths.grip([0], particles=[20], ids=[1])
    if kind is None:
        ask(cloths)
    else:
        with pytest.raises(kind):
            ask(cloths)
    answer = cloths.step(grips=True)
    assert np.allclose(answer.positions[:, 0], [0, 0.25, 0]) and answer.grips.particles.tolist() == [[-1], [20]]
    assert not cloths._pending._tables


@pytest.mark.parametrize("error", [
    drape.Unavailable("cut"), drape.ResourceExhausted(reason="DEVICE_MEMORY"), drape.DeadlineExceeded(),
    drape.ResourceExhausted(reason="QUEUE_FULL", unanswered_tries=1)])
def test_controls_are_gone_with_a_step_that_may_be_done(session, spec, error):
    cloths = session.create(spec)
    cloths.move_pins([0], [0, 0.25, 0])
    refused(cloths, error)
    assert not cloths.step().positions[0, 0].any()


def test_controls_of_a_world_wait_for_all_its_cloths(session, spec):
    one, other = (session.create(spec, origins=[[k, 0, 0]], world="w") for k in range(2))
    one.move_pins([0], [0, 0.25, 0])
    with pytest.raises(drape.FailedPrecondition, match="WORLD_INCOMPLETE"):
        one.step()
    session.step([other, one])
    assert np.allclose(one.positions[0, 0], [0, 0.25, 0])


def test_restarts_of_unlike_kinds_in_one_step_are_refused_and_wait(session, spec):
    one, other = session.create(spec), session.create(spec)
    session.step([one, other], 3)
    one.restart()
    other.restart(transforms=[0, 1, 0, 0, 0, 0, 1])
    with pytest.raises(drape.InvalidArgument, match="transforms: cloths of one step start again all of them with"):
        session.step([one, other])
    assert one.step().step_count == [1] and other.step().positions[0, 0].tolist() == [0, 1, 0]


@pytest.mark.parametrize("batches, words", [
    (lambda one, other: one, "<1 cloths .* is not a list of Cloths"), (lambda one, other: [one, 3], "is not a list of Cloths"),
    (lambda one, other: [one, one], "one is given twice"), (lambda one, other: [one, other], "not all of this session")])
def test_batches_of_one_step_are_cloths_of_the_session(client, session, spec, batches, words):
    with client.session() as another:
        with pytest.raises(drape.InvalidArgument, match=f"batches: .*{words}"):
            session.step(batches(session.create(spec), another.create(spec)))
    assert session.step([]) == []
