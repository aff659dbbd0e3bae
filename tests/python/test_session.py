import gc
import re
import shutil
import threading
import time

import numpy as np
import pytest

import drape
from conftest import sheet


def test_a_session_ends_with_its_block_and_its_cloths(client):
    with client.session() as session:
        session.create(sheet())
        name = session.name
    with pytest.raises(drape.SessionLost):
        client.session(name=name)


def test_a_session_that_is_dropped_is_deleted(client):
    session = client.session()
    name = session.name
    del session
    gc.collect()
    with pytest.raises(drape.SessionLost):
        client.session(name=name)


def test_an_attached_session_is_left_alone(client, session):
    cloths = session.create(sheet(), count=3)
    cloths.step(4)
    with client.session(name=session.name) as other:
        same = other.attach()
        assert same.ids.tolist() == cloths.ids.tolist()
        assert same.step_count.tolist() == [4, 4, 4]
        assert other.attach(cloths.ids[1:]).num == 2
        assert np.array_equal(same.positions, cloths.positions)
        assert np.array_equal(same.triangles(), cloths.triangles()) and same.triangles().shape == (50, 3)
    assert cloths.step().step_count.tolist() == [5, 5, 5]


def test_unlike_cloths_are_not_one_batch(client, session):
    with pytest.raises(drape.FailedPrecondition, match="no cloths"):
        session.attach()
    session.create(sheet(6))
    session.create(sheet(7))
    with pytest.raises(drape.InvalidArgument, match=r"\[36, 49\]"):
        session.attach()
    assert [cloth.shape.particles for cloth in session.list()] == [36, 49]


def test_attaching_many_asks_a_few_times(client, session, monkeypatch):
    cloths = session.create(sheet(2), count=1200)
    asked = []
    plain = drape.connection.Connection._ask
    monkeypatch.setattr("drape.connection.Connection._ask",
                        lambda self, of, call, tries: asked.append(call.method) or plain(self, of, call, tries))
    order = [7, 1199, 3, 500, 2, 0, 1, 900, 4]
    some = session.attach(cloths.ids[order])
    assert some.ids.tolist() == cloths.ids[order].tolist() and asked == ["ListCloths", "ListCloths"]
    del asked[:]
    assert session.attach(cloths.ids[[5, 3]]).ids.tolist() == cloths.ids[[5, 3]].tolist()
    assert asked == ["GetCloth", "GetCloth"]
    assert session.attach(cloths.ids[:9].tolist()).num == 9, "the first page is enough"
    assert asked[2:] == ["ListCloths"]
    del asked[:]
    other = session.restore(cloths.snapshot())
    assert other.num == 1200 and asked.count("GetCloth") == 0 and len(asked) < 10
    with pytest.raises(drape.NotFound, match="no cloth 7 "):
        session.attach([7, *cloths.ids[:20].tolist()])


def test_the_lease_renews_itself(client):
    with client.session(ttl_s=1) as session:
        cloths = session.create(sheet())
        time.sleep(1.6)
        assert session.lease_error is None
        assert cloths.step().step_count == [1]


def test_a_lost_lease_is_told(client):
    with client.session(ttl_s=1) as session:
        with client.session(name=session.name) as other:
            other._is_owner = True
            other._connection.run(_delete(session.name))
        end = time.monotonic() + 5
        while session.lease_error is None and time.monotonic() < end:
            time.sleep(0.02)
        assert isinstance(session.lease_error, drape.SessionLost)


def _delete(name):
    from drape.operations import Route, Unary

    yield Unary("DeleteSession", drape.v1.DeleteSessionRequest(name=name), Route(name))


def test_what_a_server_that_started_again_has_lost_is_told(restarted):
    with drape.connect(restarted.address) as client, client.session() as session:
        cloths = session.create(sheet())
        positions = cloths.step(3).positions
        restarted.drain()
        restarted.start()
        for ask in (cloths.step, cloths.read, session.list, lambda: session.create(sheet()), lambda: _pipelined(cloths)):
            with pytest.raises(drape.StateLost) as caught:
                _again(ask)
            assert caught.value.reason == "STATE_LOST" and isinstance(caught.value, drape.FailedPrecondition)
            assert caught.value.metadata["told_step"] == "3" and "at steps 3 to 3" in caught.value.message
            assert re.search(r"as it was at 2\d\d\d-\d\d-\d\dT", caught.value.message)
        assert session.lease_error is None
        session.renew()  # the session is there; what it holds is not looked at
        with pytest.raises(drape.StateLost):
            cloths.step()
        session.reattach()
        same = session.attach()
        assert same.ids.tolist() == cloths.ids.tolist() and same.step_count.tolist() == [3]
        assert np.array_equal(same.positions, positions)
        assert same.step().step_count.tolist() == [4]
        assert _pipelined(same).step_count.tolist() == [5]


def test_a_session_that_did_not_come_back_is_lost(restarted):
    with drape.connect(restarted.address) as client:
        session = client.session()
        restarted.drain()
        shutil.rmtree(restarted.folder / "checkpoints")
        restarted.start()
        with pytest.raises(drape.SessionLost):
            _again(session.reattach)
        with pytest.raises(drape.SessionLost, match="started again"):
            session.list()


def _again(ask):
    """Until the connection is there again."""
    end = time.monotonic() + 30
    while True:
        try:
            return ask()
        except drape.Unavailable:
            assert time.monotonic() < end
            time.sleep(0.05)


def _pipelined(cloths):
    with cloths.pipeline(depth=1) as steps:
        return steps.step()


def test_its_thread_ends_with_it(client):
    before = {thread for thread in threading.enumerate() if thread.name == "drape-lease"}
    session = client.session()
    mine = {thread for thread in threading.enumerate() if thread.name == "drape-lease"} - before
    assert len(mine) == 1
    session.close()
    mine.pop().join(2)
    assert {thread for thread in threading.enumerate() if thread.name == "drape-lease"} <= before


def test_copies_have_their_places_and_differences(session):
    turned = [0, 0, 0, 0, np.sin(np.pi / 4), 0, np.cos(np.pi / 4)]  # a quarter about y
    cloths = session.create(sheet(), 2, origins=[[0, 0, 0], [3, 0, 0]], transforms=[[0, 1, 0, 0, 0, 0, 1], turned],
                            overrides=[drape.ClothOverride(), drape.ClothOverride(gravity_m_per_s2=[0, 0, 0])])
    positions = cloths.positions
    assert np.allclose(positions[0, 5], [1, 1, 0], atol=1e-6)
    assert np.allclose(positions[1, 5], [3, 0, -1], atol=1e-6)
    fallen = cloths.step(30).positions
    assert fallen[0, 35, 1] < 0.9 and np.allclose(fallen[1], positions[1], atol=1e-5)
    with pytest.raises(drape.InvalidArgument, match=r"origins: has the shape \(3, 3\), which does not fit \(2, 3\)"):
        session.create(sheet(), 2, origins=np.zeros((3, 3)))


def test_threads_share_a_session(session):
    batches = [session.create(sheet(), count=2) for _ in range(4)]
    threads = [threading.Thread(target=lambda b=batch: [b.step() for _ in range(25)]) for batch in batches]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(batch.step_count.tolist() == [25, 25] for batch in batches)
    assert all(np.array_equal(batch.positions, batches[0].positions) for batch in batches)


def test_cloths_of_a_world_rest_on_each_other(client, session):
    def fallen(height_m, side):
        return drape.v1.ClothSpec(
            grid=drape.v1.Grid(columns=side, rows=side, width_m=0.3, height_m=0.3),
            transform=drape.v1.Transform(position_m=[0, height_m, 0]),
            material=drape.v1.Material(thickness_m=0.004),
            environment=drape.v1.Environment(colliders=[drape.v1.Collider(
                plane=drape.v1.Plane(point_m=[0, 0, 0], normal=[0, 1, 0]))]))

    lower = session.create(fallen(0.01, 7), world="heap")
    upper = session.create(fallen(0.02, 8), world="heap")
    with pytest.raises(drape.FailedPrecondition, match=str(upper.ids[0])) as refused:
        lower.step()
    assert refused.value.reason == "WORLD_INCOMPLETE" and "session.step steps batches of one world" in str(refused.value)
    by_upper, by_lower = (answer.contacts for answer in session.step([upper, lower], 30, contacts=True))
    assert set(by_upper.colliders.tolist()) == {-1} and set(by_lower.colliders.tolist()) == {-1, 0}
    forces = by_upper.of_cloth().sum((0, 1)), by_lower.of_cloth().sum((0, 1))
    assert np.allclose(forces[0], -forces[1], atol=1e-5 * np.abs(by_lower.impulses).sum())
    answers = session.step([upper, lower], 30, report=True)
    assert [answer.step_count.tolist() for answer in answers] == [[60], [60]]
    assert answers[0].reports[0].cloth_id == upper.ids[0] and answers[1].reports[0].near_pairs > 0
    assert abs(upper.positions[0, :, 1].mean() - lower.positions[0, :, 1].mean() - 0.004) < 4e-4
    assert session.attach(lower.ids).num == 1
