import numpy as np
import pytest

import drape
from conftest import bits, sheet
from drape import Collider, Environment, Sphere, StateView


def test_a_step_brings_positions_of_every_cloth(session, spec):
    cloths = session.create(spec, count=3, origins=[[0, 0, 0], [2, 0, 0], [4, 0, 0]])
    answer = cloths.step(5)
    assert answer.positions.shape == (3, 36, 3) and answer.positions.dtype == np.float32
    assert answer.step_count.tolist() == [5, 5, 5] == cloths.step_count.tolist()
    assert np.allclose(answer.time_s, 5 / 60)
    assert answer.positions[1, 0].tolist() == [2, 0, 0]  # a pin, in the world
    assert cloths.positions is answer.positions
    assert answer.timing.device_us > 0 and not answer.faulted.any()


def test_answers_are_read_only_and_outlive_the_next_ones(session, spec):
    cloths = session.create(spec, count=2)
    first = cloths.step().positions
    kept = bits(first)
    for _ in range(20):
        last = cloths.step().positions
    assert bits(first) == kept and bits(last) != kept
    with pytest.raises(ValueError):
        first[0, 0, 0] = 1


def test_views_choose_what_travels(session, spec):
    cloths = session.create(spec, count=2)
    assert cloths.step(view=None).positions is None
    both = cloths.step(view=drape.POSITIONS_AND_VELOCITIES)
    assert both.velocities.shape == both.positions.shape == (2, 36, 3)
    corners = cloths.step(view=StateView(positions=True, particles=[0, 35]))
    assert corners.positions.shape == (2, 2, 3)
    assert np.array_equal(cloths.positions[:, [0, 35]], corners.positions)  # read, since the step brought two only
    with pytest.raises(drape.InvalidArgument, match="view"):
        cloths.step(view="positions")


def test_what_a_step_did_not_bring_is_read(session, spec):
    cloths = session.create(spec, count=2)
    assert cloths.positions.shape == (2, 36, 3)  # before the first step
    cloths.step(10, view=None)
    assert cloths.velocities.any()
    assert np.allclose(cloths.time_s, 10 / 60)
    read = cloths.read(velocities=True)
    assert np.array_equal(read.positions, cloths.positions) and np.array_equal(read.velocities, cloths.velocities)


def test_ids_choose_the_cloths_and_their_order(session, spec):
    cloths = session.create(spec, count=4)
    answer = cloths.step(3, ids=[2, 0])
    assert answer.rows.tolist() == [2, 0] and answer.positions.shape == (2, 36, 3)
    cloths.step(1, ids=np.array([False, False, False, True]))
    assert cloths.step_count.tolist() == [3, 0, 3, 1]
    assert cloths.read(ids=[3, 2]).step_count.tolist() == [1, 3]
    assert np.array_equal(cloths.read(ids=[3, 2]).positions, cloths.positions[[3, 2]])


def test_an_empty_selection_does_nothing(session, spec):
    """In the protocol a request names at least one cloth."""
    cloths = session.create(spec, count=3)
    cloths.step(2)
    none = np.zeros(3, bool)
    assert cloths.step(ids=none).positions.shape == (0, 36, 3)
    answer = cloths.step(ids=[], view=drape.StateView(velocities=True, particles=[3], reductions=[drape.StateView.BOX]))
    assert answer.positions is None and answer.velocities.shape == (0, 1, 3) and answer.box.shape == (0, 2, 3)
    assert cloths.step(ids=[], view=None).positions is None
    assert cloths.read(ids=[]).positions.dtype == np.float32 and cloths.read(ids=[]).rows.size == 0
    cloths.reset(none)
    cloths.update(spec, ["environment.gravity_m_per_s2"], none)
    cloths.move_pins([0], [9, 9, 9], ids=none)
    assert cloths.read().step_count.tolist() == [2, 2, 2]
    assert not cloths.step().positions[:, 0].any()


def test_pins_go_where_they_are_sent(session, spec):
    cloths = session.create(spec, count=3)
    targets = np.arange(18.0).reshape(3, 2, 3) * 0.01
    cloths.move_pins([0, 5], targets)
    answer = cloths.step()
    assert np.allclose(answer.positions[:, [0, 5]], targets, atol=1e-6)
    cloths.move_pins([0], [0, 1, 0], over_s=2 / 60, ids=[1])
    middle = cloths.step().positions[1, 0]
    assert np.allclose(middle, (targets[1, 0] + [0, 1, 0]) / 2, atol=1e-6)
    cloths.move_pins([[0], [5], [0]], targets[:, :1])  # another particle in each cloth
    assert np.allclose(cloths.step().positions[1, 5], targets[1, 0], atol=1e-6)


def test_controls_wait_for_the_step_of_their_cloth(session, spec):
    cloths = session.create(spec, count=2)
    cloths.move_pins([0], [0, 0.5, 0])
    assert np.allclose(cloths.step(ids=[0]).positions[0, 0], [0, 0.5, 0])
    assert not cloths.read(ids=[1]).positions[0, 0].any()
    assert np.allclose(cloths.step(ids=[1]).positions[0, 0], [0, 0.5, 0])
    cloths.move_pins([0], [0, 0.9, 0])
    cloths.reset([0])  # forgets those of cloth 0
    assert np.allclose(cloths.step().positions[:, 0, 1], [0, 0.9])


def test_a_bad_control_is_refused_and_gone(session, spec):
    cloths = session.create(spec)
    cloths.move_pins([7], [0, 0, 0])
    with pytest.raises(drape.Error) as caught:
        cloths.step()
    assert caught.value.reason in ("PIN_NOT_FOUND", "INVALID_FIELDS")
    assert cloths.step().step_count == [1]
    with pytest.raises(drape.InvalidArgument, match="targets_m"):
        cloths.move_pins([0], np.zeros((4, 3)))


def test_colliders_and_rest_lengths_follow(session):
    ball = Collider(sphere=Sphere(center_m=[0, -5, 0], radius_m=0.2))
    cloths = session.create(sheet(environment=Environment(colliders=[ball]), pins=[drape.Pin(particle=0)]), count=2)
    cloths.move_colliders([0], np.array([[[0, -1, 0]], [[0, -2, 0]]]))
    cloths.scale_rest_lengths([0.5, 1.0], over_s=1.0)
    cloths.set_rest_lengths([0], 0.3, ids=[1])
    cloths.step()
    assert cloths.descriptions() == [cloths.describe(row) for row in (0, 1)]
    poses = [cloth.collider_poses[0].position_m for cloth in cloths.descriptions([1, 0])][::-1]
    assert [list(pose) for pose in poses] == [[0, -1, 0], [0, -2, 0]]
    moved = cloths.step(120).positions
    lengths = np.linalg.norm(moved[:, 6] - moved[:, 0], axis=1)  # down from the first pin
    assert lengths[0] == pytest.approx(0.1, rel=0.05) and lengths[1] == pytest.approx(0.2, rel=0.05)


def test_reset_is_exact_and_per_cloth(session, spec):
    cloths = session.create(spec, count=2)
    begin = bits(cloths.positions)
    first = bits(cloths.step(7).positions)
    cloths.reset()
    assert bits(cloths.positions) == begin and cloths.step_count.tolist() == [0, 0]
    assert bits(cloths.step(7).positions) == first
    cloths.reset([1])
    assert cloths.step_count.tolist() == [7, 0]


def test_reset_starts_anew_somewhere_else(session, spec):
    cloths = session.create(spec, count=3, origins=[[0, 0, 0], [2, 0, 0], [4, 0, 0]])
    kept = bits(cloths.step(3, ids=[0]).positions)
    up = [0, 1, 0, 0, 0, 0, 1]
    calm = drape.ClothOverride(gravity_m_per_s2=[0, 0, 0])
    cloths.reset([2, 1], transforms=[up, up], overrides=[calm, drape.ClothOverride()])
    assert cloths.step_count.tolist() == [3, 0, 0] and len(session.list()) == 3
    assert bits(cloths.read(ids=[0]).positions) == kept
    assert cloths.positions[:, 0].tolist() == [[0, 0, 0], [2, 1, 0], [4, 1, 0]]
    begin = cloths.positions
    after = cloths.step(5).positions
    assert after[1, 35, 1] < 0.999 and np.allclose(after[2], begin[2], atol=1e-6)
    with pytest.raises(drape.InvalidArgument):
        cloths.reset([0], transforms=[[0, 0, 0, 0, 0, 0, 0]])  # no rotation
    assert cloths.step().step_count.tolist() == [9, 6, 6]


def test_states_are_written(session, spec):
    cloths = session.create(spec, count=2, origins=[[0, 0, 0], [2, 0, 0]])
    cloths.step(10)
    kept = cloths.read(velocities=True)
    cloths.step(20)
    cloths.write(kept.positions[[1]], kept.velocities[[1]], ids=[1])
    back = cloths.read(velocities=True)
    assert np.allclose(back.positions[1], kept.positions[1], atol=1e-6)
    assert np.array_equal(back.velocities[1], kept.velocities[1]) and cloths.step_count.tolist() == [30, 30]
    assert not np.allclose(back.positions[0], kept.positions[0], atol=1e-3)
    cloths.write(np.zeros((36, 3)) + [0, 1, 0], frame="ENVIRONMENT")  # spread to both, at rest
    assert np.allclose(cloths.positions, np.array([[[0, 1, 0]], [[2, 1, 0]]]))
    assert not cloths.velocities.any()
    with pytest.raises(drape.InvalidArgument, match="positions_m"):
        cloths.write(np.zeros((2, 35, 3)))
    with pytest.raises(drape.InvalidArgument):
        cloths.write(np.full((2, 36, 3), np.nan))


def test_saved_states_are_gone_back_to_and_branched_from(session, spec):
    cloths = session.create(spec, count=3)
    cloths.randomise(gravity=[[0, -1, 0], [0, -9, 0], [1, -9, 0]])
    cloths.step(10)
    cloths.save("ten")
    ends = cloths.step(10).positions
    cloths.randomise(gravity=[0, 5, 0])
    cloths.reset()
    cloths.load("ten")
    assert cloths.step_count.tolist() == [10, 10, 10]
    assert bits(cloths.step(10).positions) == bits(ends)
    cloths.load("ten", [0, 2], of=[1, 1])  # two branches
    assert cloths.step_count.tolist() == [10, 20, 10]
    branches = cloths.step(10, ids=[0, 2]).positions
    assert bits(branches[0]) == bits(branches[1]) == bits(ends[1])
    cloths.drop("ten")
    with pytest.raises(drape.NotFound, match="ten"):
        cloths.load("ten")


def test_parameters_are_drawn_for_each_cloth(session, spec):
    cloths = session.create(spec, count=3)
    cloths.randomise(gravity=[[0, -1, 0], [0, -2, 0]], damping=[0.5, 0.25], ids=[0, 2])
    cloths.randomise(wind=[1, 0, 0], friction_static=0.9, friction_dynamic=0.8)
    found = [cloths.describe(row).environment for row in range(3)]
    assert [list(e.gravity_m_per_s2)[1:2] for e in found] == [[-1], [-9.81], [-2]]
    assert all(list(e.wind_m_per_s) == [1, 0, 0] for e in found)
    ends = cloths.step(30).positions[:, 35, 1]
    assert ends[0] > ends[2] > ends[1]
    cloths.randomise(np.zeros(3, bool), gravity=[0, 5, 0])
    assert cloths.describe(1).environment.gravity_m_per_s2[1] == -9.81
    with pytest.raises(drape.InvalidArgument, match="gravity"):
        cloths.randomise(gravity=np.zeros((2, 3)))


def test_update_changes_what_it_names(session, spec):
    cloths = session.create(spec, count=2)
    up = drape.ClothSpec(environment=Environment(gravity_m_per_s2=[0, 9.81, 0]))
    cloths.update(up, "environment.gravity_m_per_s2", ids=[1])
    ends = cloths.step(20).positions[:, 35, 1]
    assert ends[0] < 0 < ends[1]


def test_a_faulted_cloth_is_told_and_the_others_go_on(session):
    def pair(stiffness):
        return drape.Particles(positions_m=[0, 0, 0, 1.01, 0, 0], masses_kg=[1, 1], springs=[
            drape.Spring(i=0, j=1, rest_length_m=1, stiffness_n_per_m=stiffness)])

    spec = drape.ClothSpec(particles=pair(1), settings=drape.StepSettings(substeps=1, time_step_s=0.001))
    cloths = session.create(spec, count=3)
    cloths.update(drape.ClothSpec(particles=pair(5e7)), "particles.springs", ids=[1])  # far beyond what is stable
    answer = cloths.step(20)
    assert answer.faulted.tolist() == cloths.faulted.tolist() == [False, True, False]
    assert answer.step_count[1] < 20 == answer.step_count[0]
    assert np.isfinite(answer.positions).all()
    assert cloths.describe(1).fault_reason and not cloths.describe(0).fault_reason
    assert cloths.step(ids=[0, 2]).faulted.tolist() == [False, False]
    assert cloths.faulted.tolist() == [False, True, False]
    cloths.update(spec, "particles.springs", ids=[1])
    cloths.reset([1])
    assert not cloths.faulted.any()
    assert cloths.step().faulted.tolist() == [False, False, False]


def test_reports_become_arrays(session, spec):
    cloths = session.create(spec, count=2)
    answer = cloths.step(5, report=True)
    strains = answer.measure("max_strain")
    assert strains.shape == (2,) and (strains > 0).all() and (strains < 0.1).all()


def test_until_and_request_ids(session, spec):
    cloths = session.create(spec)
    assert cloths.step(until=12).step_count == [12]
    once = cloths.step(2, request_id="a")
    again = cloths.step(2, request_id="a")
    assert once.step_count == again.step_count == [14] and bits(once.positions) == bits(again.positions)
    with pytest.raises(drape.InvalidArgument, match="steps"):
        cloths.step(0)


def test_large_answers_are_streamed_into_one_array(session):
    small = sheet(64, settings=drape.StepSettings(substeps=1))
    cloths = session.create(small, count=48)  # 2.4 MB
    answer = cloths.step(2)
    assert answer.positions.shape == (48, 4096, 3) and not answer.positions.flags.writeable
    alone = cloths.read(ids=[47]).positions[0]
    assert np.array_equal(answer.positions[47], alone)
    out = np.empty_like(answer.positions)
    assert cloths.read(out=out).positions is out and np.array_equal(out, answer.positions)
    part = cloths.read(ids=[40, 3]).positions
    assert np.array_equal(part, answer.positions[[40, 3]])
    with pytest.raises(drape.InvalidArgument, match="out"):
        cloths.read(out=np.empty((1, 2, 3), np.float32))


def test_a_cloth_larger_than_a_chunk_is_put_together(session):
    cloths = session.create(sheet(320, settings=drape.StepSettings(substeps=1)), count=2, origins=[[0, 0, 0], [5, 0, 0]])
    read = cloths.read(velocities=True)  # 1.2 MB per column and cloth: split between chunks
    grid = read.positions.reshape(2, 320, 320, 3)
    assert np.allclose(grid[..., 0] - [[[0]], [[5]]], np.linspace(0, 1, 320), atol=1e-5)
    assert np.allclose(grid[..., 2], np.linspace(0, 1, 320)[:, None], atol=1e-6)


VIEWS = {
    "positions": drape.POSITIONS,
    "both": drape.POSITIONS_AND_VELOCITIES,
    "some": drape.StateView(positions=True, velocities=True, particles=[0, 7, 35]),
    "float16": drape.StateView(positions=True, velocities=True, encoding=drape.StateView.FLOAT16),
    "fixed16": drape.StateView(positions=True, encoding=drape.StateView.FIXED16),
    "reductions": drape.StateView(reductions=[drape.StateView.CENTROID, drape.StateView.BOX]),
    "reductions and positions": drape.StateView(positions=True, reductions=[drape.StateView.CENTROID]),
}
PARTS = ("positions", "velocities", "origins", "centroid", "box", "step_count", "time_s", "faulted")


@pytest.mark.parametrize("side, count", [(8, 30), (320, 2)])  # 1.2 MB per column of a large cloth: split between chunks
@pytest.mark.parametrize("view", VIEWS.values(), ids=VIEWS.keys())
def test_an_answer_in_chunks_is_the_one_of_one_message(session, monkeypatch, side, count, view):
    spec = sheet(side, settings=drape.StepSettings(substeps=1, max_iterations=1))
    origins = [[k, 0.5 * k, 0] for k in range(count)]
    in_chunks, whole = (session.create(spec, count=count, origins=origins) for _ in range(2))
    ids = [1, 0] + list(range(2, count))
    for above in (-1, 1 << 40):
        monkeypatch.setattr("drape.cloths._CHUNKS_ABOVE_BYTES", above)
        batch = in_chunks if above < 0 else whole
        batch.step(5, view=None)
        answers = [batch.step(view=view, report=True), batch.step(view=view, ids=ids)]
        with batch.pipeline(2) as steps:
            steps.step(view=view)
            steps.step(view=view, ids=ids)
            answers += steps.drain()
        if above < 0:
            expected = answers
    for one, other in zip(expected, answers, strict=True):
        for part in PARTS:
            values = getattr(one, part), getattr(other, part)
            assert (values[0] is None) == (values[1] is None), part
            assert values[0] is None or bits(values[0]) == bits(values[1]), part
        assert [r.max_strain for r in one.reports] == [r.max_strain for r in other.reports]
        assert one.positions is None or not one.positions.flags.writeable
    assert in_chunks.step_count.tolist() == whole.step_count.tolist() == [8 + 1] * count


def test_answers_may_be_larger_than_any_message(session):
    cheap = sheet(32, settings=drape.StepSettings(substeps=1, max_iterations=1))
    cloths = session.create(cheap, count=3000)  # 74 MB; a message has 64 MiB of states at most
    answer = cloths.step(view=drape.POSITIONS_AND_VELOCITIES)
    assert answer.positions.shape == answer.velocities.shape == (3000, 1024, 3)
    assert np.array_equal(answer.positions[2999], cloths.read(ids=[2999]).positions[0])
    assert (answer.positions == answer.positions[0]).all()


def test_double_precision_arrives_as_it_is(reference):
    with reference.session() as session:
        positions = session.create(sheet()).step().positions
        assert positions.dtype == np.float64
        assert (positions.astype(np.float32) != positions).any()


def test_tiles_are_the_pictures_of_each_cloth_alone(session, spec):
    origins = np.array([[0, 0, 0], [30, 0, -4], [0, 2, 0]])
    cloths = session.create(spec, count=3, origins=origins)
    cloths.move_pins([0], np.array([[[0, 0, 0]], [[0, 0.3, 0]], [[0.2, 0, 0]]]))
    cloths.step(10)
    eye, target = np.array([0.5, 1.0, 2.5]), np.array([0.5, -0.3, 0.5])
    tiles = cloths.render_tiles(48, 32, drape.Camera(eye_m=eye, target_m=target))
    assert tiles.shape == (3, 32, 48, 3) and tiles.dtype == np.uint8
    for k, origin in enumerate(origins):
        camera = drape.Camera(eye_m=eye + origin, target_m=target + origin)
        alone = cloths.render(48, 32, ids=[k], camera=camera)
        # But for the rounding of places: a sample at an edge may change sides.
        assert np.count_nonzero(np.abs(tiles[k].astype(int) - alone) > 2) <= alone.size / 200
    assert bits(tiles[0]) != bits(tiles[1])
    assert cloths.render_tiles(48, 32, drape.Camera(eye_m=eye, target_m=target), ids=[2]).shape == (1, 32, 48, 3)
    cheap = cloths.render_tiles(48, 32, drape.Camera(eye_m=eye, target_m=target), samples=1, hide_shadows=True)
    assert cheap.shape == tiles.shape and bits(cheap) != bits(tiles)
    assert cloths.render_tiles(48, 32, None, ids=[]).shape == (0, 32, 48, 3)
    again, depths = cloths.render_tiles(48, 32, drape.Camera(eye_m=eye, target_m=target), with_depths=True)
    assert bits(again) == bits(tiles) and depths.shape == (3, 32, 48) and depths.dtype == np.float32
    # What is seen of a cloth lies between its nearest and its farthest particle; balls around pins stand out.
    _, bare = cloths.render_tiles(48, 32, drape.Camera(eye_m=eye, target_m=target), with_depths=True, hide_pins=True)
    forward = (target - eye) / np.linalg.norm(target - eye)
    for k, origin in enumerate(origins):
        along = (cloths.positions[k] - origin - eye) @ forward
        seen = bare[k][np.isfinite(bare[k])]
        assert seen.size > 50 and along.min() - 1e-3 <= seen.min() and seen.max() <= along.max() + 1e-3
    rgb, one = cloths.render(48, 32, ids=[1], camera=drape.Camera(eye_m=eye + origins[1], target_m=target + origins[1]),
                             with_depths=True)
    assert np.count_nonzero(np.abs(tiles[1].astype(int) - rgb) > 2) <= rgb.size / 200
    assert np.count_nonzero(~np.isclose(one, depths[1], rtol=1e-3)) <= one.size / 200
    assert [part.shape for part in cloths.render_tiles(48, 32, None, ids=[], with_depths=True)] == [(0, 32, 48, 3), (0, 32, 48)]
    with pytest.raises(drape.InvalidArgument, match="camera"):
        cloths.render_tiles(48, 32, None)
    with pytest.raises(drape.InvalidArgument, match="tiles"):
        cloths.render_tiles(4096, 4096, drape.Camera(eye_m=eye, target_m=target))


def test_pictures(session, spec):
    cloths = session.create(spec)
    assert cloths.render_png(64, 48).startswith(b"\x89PNG")
    pixels = cloths.render(64, 48)
    assert pixels.shape == (48, 64, 3) and pixels.dtype == np.uint8 and pixels.std() > 1


def test_a_snapshot_goes_on_with_the_same_bits(client, session):
    cloths = session.create(sheet(), count=2)
    cloths.step(5)
    snapshot = cloths.snapshot()
    expected = cloths.step(3).positions.copy()
    with client.session() as other:
        again = other.restore(snapshot)
        assert again.step_count.tolist() == [5, 5]
        assert np.array_equal(again.step(3).positions, expected)
        one = other.restore(cloths.snapshot(ids=[1]))
        assert one.num == 1 and one.step_count.tolist() == [8]
        ids = [other.restore(snapshot, request_id="once").ids.tolist() for _ in range(2)]
        assert ids[0] == ids[1] and len(other.list()) == 5
        with pytest.raises(drape.InvalidArgument) as damaged:
            other.restore(snapshot[:-1])
        assert damaged.value.reason == "SNAPSHOT_DAMAGED"
        with pytest.raises(drape.InvalidArgument, match="SNAPSHOT_DAMAGED: snapshot: is empty$"):
            other.restore(b"")


def test_impulses_are_the_weight_of_what_hangs_and_lies(session):
    spec = sheet(pins=[drape.Pin(particle=k) for k in range(6)], max_grips=1)
    spec.environment.colliders.add().plane.MergeFrom(drape.v1.Plane(point_m=[0, -5, 0], normal=[0, 1, 0]))
    spec.material.damping_per_s = 10
    cloths = session.create(spec, count=3)
    assert cloths.step().impulses is None
    answer = cloths.step(240, impulses=True)
    impulses = answer.impulses
    assert impulses.pins.shape == (3, 6, 3) and impulses.particles.tolist() == list(range(6))
    assert impulses.colliders.shape == impulses.angular.shape == (3, 1, 3)
    assert (impulses.colliders == 0).all() and (impulses.grips == 0).all()
    weight = 0.2 * 9.81 / 60
    assert np.allclose(impulses.pins.sum(axis=1), [0, -weight, 0], atol=0.02 * weight)
    one = cloths.step(impulses=True, ids=[1]).impulses
    assert one.pins.shape == (1, 6, 3)


def test_contacts_of_a_sheet_that_lies_are_its_weight(session):
    spec = sheet(pins=[])
    spec.environment.colliders.add().plane.MergeFrom(drape.v1.Plane(point_m=[0, 0, 0], normal=[0, 1, 0]))
    cloths = session.create(spec, count=2)
    assert cloths.step().contacts is None
    contacts = cloths.step(contacts=True, view=None).contacts
    assert contacts.cloths.tolist() == [0] * 36 + [1] * 36
    assert contacts.particles.tolist() == 2 * list(range(36)) and (contacts.colliders == 0).all()
    weight = 0.2 * 9.81 / 60
    assert np.allclose(contacts.of_colliders().sum(axis=1), [0, weight, 0], atol=1e-3 * weight)
    assert contacts.of_cloth().shape == (2, 36, 3) and not contacts.of_cloth().any()
    answer = cloths.step(contacts=True, impulses=True, ids=[1])
    assert np.allclose(answer.contacts.of_colliders().sum(axis=1), -answer.impulses.colliders[:, 0], atol=1e-6 * weight)
    assert answer.positions.shape == (1, 36, 3) and answer.contacts.of_colliders().shape == (1, 36, 3)


def test_impulses_of_a_batch_with_a_cloth_that_is_done_are_nan_there(session, spec):
    cloths = session.create(spec, count=2)
    cloths.step(ids=[1])
    impulses = cloths.step(until=1, impulses=True).impulses
    assert np.isfinite(impulses.pins[0]).all() and np.isnan(impulses.pins[1]).all()


def test_what_is_read_fills_what_is_given(session, spec):
    cloths = session.create(spec, count=2)
    cloths.step(5)
    expected = cloths.read(velocities=True)
    positions, velocities = np.zeros((2, 2, 36, 3), np.float32)
    assert cloths.read(out=positions).positions is positions and bits(positions) == bits(expected.positions)
    assert cloths.read(positions=False, velocities=True, out=velocities).velocities is velocities
    assert bits(velocities) == bits(expected.velocities)
    positions[:] = velocities[:] = 0
    both = cloths.read(velocities=True, out={"positions": positions, "velocities": velocities})
    assert both.positions is positions and bits(positions) == bits(expected.positions)
    assert both.velocities is velocities and bits(velocities) == bits(expected.velocities)
    velocities[:] = 0
    assert cloths.read(velocities=True, out={"velocities": velocities}).positions is not positions and velocities.any()


def test_measures_need_reports(session, spec):
    cloths = session.create(spec, count=2)
    with pytest.raises(drape.FailedPrecondition, match="report=True"):
        cloths.step().measure("max_strain")
    assert cloths.step(report=True).measure("max_strain").shape == (2,)
    assert cloths.step(report=True, ids=[]).measure("max_strain").shape == (0,)


def test_some_cloths_of_a_batch_are_deleted_and_the_others_move_up(session, spec):
    cloths = session.create(spec, count=4, origins=[[k, 0, 0] for k in range(4)])
    ids = cloths.ids
    cloths.step(2, ids=[2])
    cloths.save("two")
    for row in range(4):
        cloths.move_pins([0], [0, 0.1 * row, 0], ids=[row])
    cloths.delete([])
    cloths.delete([0, -3])
    assert len(cloths) == 2 and cloths.ids.tolist() == ids[2:].tolist() and len(session.list()) == 2
    assert cloths.step_count.tolist() == [2, 0] and cloths.faulted.shape == (2,)
    assert cloths.positions[:, 0, 0].tolist() == [2, 3]
    answer = cloths.step()
    assert answer.step_count.tolist() == [3, 1]
    assert np.allclose(answer.positions[:, 0], [[2, 0.2, 0], [3, 0.3, 0]])
    cloths.load("two", of=[0, 1])
    assert cloths.step(ids=[1]).step_count.tolist() == [1] and not cloths.faulted.any()
    cloths.delete(np.array([True, True]))
    assert session.list() == []
    with pytest.raises(drape.NotFound, match="CLOTH_NOT_FOUND"):
        cloths.step()
