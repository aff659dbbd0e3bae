import asyncio
import inspect

import numpy as np
import pytest

import drape
import drape.aio
from conftest import bits, sheet


def test_the_names_are_the_same():
    for sync, other in ((drape.Client, drape.aio.Client), (drape.Session, drape.aio.Session),
                        (drape.Cloths, drape.aio.Cloths)):
        for name, member in inspect.getmembers(sync):
            if not name.startswith("_"):
                assert hasattr(other, name), f"drape.aio.{other.__name__}.{name}"


def test_cloths_step_side_by_side_with_the_same_bits(client, session, spec):
    alone = session.create(spec, count=2)
    alone.step(10)

    async def program():
        async with await drape.aio.connect(client.address) as other, await other.session() as mine:
            batches = [await mine.create(spec, count=2) for _ in range(3)]
            answers = await asyncio.gather(*(batch.step(10) for batch in batches))
            with pytest.raises(drape.FailedPrecondition, match="read"):
                _ = batches[0].velocities
            await batches[0].read(positions=False, velocities=True)
            assert batches[0].velocities.any()
            assert [cloth.id for cloth in await batches[0].descriptions([1])] == [batches[0].ids[1]]
            with pytest.raises(drape.InvalidArgument):
                await batches[0].step(0)
            await batches[0].reset()
            assert batches[0].step_count.tolist() == [0, 0]
            return answers

    for answer in asyncio.run(program()):
        assert bits(answer.positions) == bits(alone.positions)


def test_large_answers_come_in_chunks(client, session):
    large = sheet(320, settings=drape.StepSettings(substeps=1, max_iterations=1))  # 1.2 MB
    alone = session.create(large)
    alone.step(3)

    async def program():
        async with await drape.aio.connect(client.address) as other, await other.session() as mine:
            cloths = await mine.create(large)
            await cloths.step()
            async with cloths.pipeline() as steps:
                await steps.step()
                await steps.step()
                return (await steps.drain())[-1]

    assert bits(asyncio.run(program()).positions) == bits(alone.positions)


def test_a_private_server_and_the_lease(spec):
    async def program():
        async with await drape.aio.launch("cpu") as other, await other.session(ttl_s=1) as mine:
            cloths = await mine.create(spec)
            await asyncio.sleep(1.5)
            assert (await cloths.step()).step_count == [1] and mine.lease_error is None
            return other._connection.server.pid, mine.name, await other.health()

    pid, _, health = asyncio.run(program())
    assert health is True
    from test_private_server import is_alive

    assert not is_alive(pid)


def test_errors_are_the_same(client):
    async def program():
        async with await drape.aio.connect(client.address) as other:
            with pytest.raises(drape.SessionLost):
                await other.session(name="sessions/none")
            assert np.dtype("<f4") == other.dtype

    asyncio.run(program())


def test_a_session_is_taken_as_it_came_back(restarted, spec):
    async def program():
        async with await drape.aio.connect(restarted.address) as client, await client.session() as session:
            cloths = await session.create(spec)
            await cloths.step(2)
            restarted.drain()
            restarted.start()
            with pytest.raises(drape.StateLost):
                while True:
                    try:
                        await cloths.step()
                    except drape.Unavailable:
                        await asyncio.sleep(0.05)
            await session.reattach()
            return await (await session.attach()).step()

    assert asyncio.run(program()).step_count.tolist() == [3]


def test_a_pipeline_has_the_same_bits(client, session, spec):
    alone = session.create(spec, count=2)

    async def program():
        async with await drape.aio.connect(client.address) as other, await other.session() as mine:
            cloths = await mine.create(spec, count=2)
            async with cloths.pipeline(depth=3) as steps:
                return [await steps.step() for _ in range(5)] + await steps.drain()

    answers = asyncio.run(program())
    assert answers[:2] == [None, None] and len(answers) == 7
    for answer in answers[2:]:
        assert bits(answer.positions) == bits(alone.step().positions)


def test_a_rollout_has_the_same_bits(client, session, spec):
    targets = np.random.default_rng(3).normal(size=(2, 6, 2, 3)) * 0.05
    expected = session.create(spec, count=2).rollout(6, steps=2, pins=[0, 5], pin_targets=targets)

    async def program():
        async with await drape.aio.connect(client.address) as other, await other.session() as mine:
            cloths = await mine.create(spec, count=2)
            with pytest.raises(drape.InvalidArgument, match="go together"):
                await cloths.rollout(6, pins=[0])
            return await cloths.rollout(6, steps=2, pins=[0, 5], pin_targets=targets)

    rows = asyncio.run(program())
    assert rows.keys() == expected.keys()
    for name in rows:
        assert rows[name].shape == expected[name].shape and bits(rows[name]) == bits(expected[name])


def test_a_rollout_of_some_cloths_by_grips_and_restarts_has_the_same_bits(client, session):
    columns = {"ids": [2, 0], "grips": [0], "grip_particles": [[[35], [35], [-1]], [[-1], [30], [31]]],
               "grip_targets": np.random.default_rng(5).normal(size=(2, 3, 1, 3)) * 0.05 + [1, 0, 1],
               "restarts": np.array([[False, True, False], [False, False, True]])}
    expected = session.create(sheet(max_grips=1), count=3).rollout(3, **columns)

    async def program():
        async with await drape.aio.connect(client.address) as other, await other.session() as mine:
            cloths = await mine.create(sheet(max_grips=1), count=3)
            assert (await cloths.rollout(2, ids=[]))["positions"].shape == (0, 2, 36, 3)
            return await cloths.rollout(3, **columns)

    found = asyncio.run(program())
    assert found.keys() == expected.keys()
    assert all(bits(found[name]) == bits(expected[name]) for name in expected)



def test_an_error_ends_a_pipeline(client, spec):
    async def program():
        async with await drape.aio.connect(client.address) as other, await other.session() as mine:
            cloths = await mine.create(spec)
            with pytest.raises(drape.Error):
                async with cloths.pipeline(depth=1) as steps:
                    cloths.move_pins([7], [0, 0, 0])
                    await steps.step()
            return (await cloths.step()).step_count[0]

    assert asyncio.run(program()) == 1
