"""Coroutines fail by errors of the package, not by those of grpc.aio or asyncio, and dropped sessions end."""

import asyncio
import gc

import pytest

import drape
import drape.aio
from conftest import sheet


def of_a_session(client, program):
    """What `program` returns, which gets a client and a session of it."""

    async def whole():
        async with await drape.aio.connect(client.address, retries=None) as other, await other.session() as mine:
            return await asyncio.wait_for(program(other, mine), 60)

    return asyncio.run(whole())


@pytest.mark.parametrize("answered", [0, 1, 3])
@pytest.mark.parametrize("wait_s", [0, 0.1])
def test_a_step_into_a_stream_that_has_failed(client, spec, answered, wait_s):
    """What was answered before comes, and then the server's error."""

    async def program(_, session):
        cloths, answers = await session.create(spec), []
        with pytest.raises(drape.InvalidArgument, match="pin_controls"):
            async with cloths.pipeline(depth=6) as steps:
                for _ in range(answered):
                    await steps.step()
                cloths.move_pins([7], [0, 0, 0])
                await steps.step()
                await asyncio.sleep(wait_s)  # refused meanwhile
                while True:
                    answers.append(await steps.step())
        assert sum(answer is not None for answer in answers) == answered
        return (await cloths.step()).step_count[0]

    assert of_a_session(client, program) > answered  # what was sent after the refused one may be done


@pytest.mark.parametrize("ask", [lambda steps: steps.step(), lambda steps: steps._next()])
def test_a_step_into_a_stream_that_was_closed(client, spec, ask):
    async def program(_, session):
        cloths = await session.create(spec)
        steps = cloths.pipeline(depth=2)
        await steps.step()
        under_way = list(steps._under_way)
        steps.close()
        steps._under_way.extend(under_way)
        with pytest.raises(drape.Cancelled):
            await ask(steps)

    of_a_session(client, program)


@pytest.mark.parametrize("depth", [1, 2])
def test_a_step_after_the_end_of_a_pipeline_says_why_there_is_none(client, spec, depth):
    async def program(_, session):
        cloths = await session.create(spec)
        steps = cloths.pipeline(depth)
        await steps.step()
        steps.close()
        with pytest.raises(drape.Cancelled, match="PIPELINE_CLOSED"):
            await steps.step()
        steps = cloths.pipeline(depth)
        cloths.move_pins([7], [0, 0, 0])
        with pytest.raises(drape.InvalidArgument) as first:
            await steps.step()
            await steps.drain()
        with pytest.raises(drape.FailedPrecondition, match="PIPELINE_FAILED") as second:
            await steps.step()
        assert str(first.value) in second.value.message
        steps.close()

    of_a_session(client, program)


def test_what_is_not_at_hand_is_named_with_the_call_that_brings_it(client, spec):
    async def program(_, session):
        cloths = await session.create(spec)
        for name, how in (("positions", "read()"), ("velocities", "read(velocities=True)"), ("time_s", "read()")):
            with pytest.raises(drape.FailedPrecondition) as caught:
                getattr(cloths, name)
            assert caught.value.reason == "NOT_READ" and caught.value.message.startswith(f"{name}: ")
            assert caught.value.message.endswith(f"await cloths.{how} first")
            await eval(f"cloths.{how}", {"cloths": cloths})
            assert len(getattr(cloths, name)) == 1
            await cloths.reset()
        gripped = await session.create(sheet(max_grips=1))
        with pytest.raises(drape.FailedPrecondition, match="NOT_READ: grip without `at` .* await cloths.read.. first"):
            gripped.grip([0], particles=[3])
        gripped.grip([0], particles=[3], at=[0, 0, 0])

    of_a_session(client, program)


def test_reading_what_somebody_closes_meanwhile(client, spec):
    async def program(_, session):
        cloths = await session.create(spec)
        frames = cloths.frames()
        await anext(frames)
        reading = asyncio.ensure_future(anext(frames))
        await asyncio.sleep(0.05)
        frames.close()
        with pytest.raises(drape.Cancelled):
            await reading
        with pytest.raises(drape.Cancelled):
            await anext(frames)

    of_a_session(client, program)


def test_a_task_that_is_cancelled_is_cancelled(client, spec):
    async def program(_, session):
        cloths = await session.create(spec)
        for reading in (cloths.frames(), cloths.run(hz=0.01, report_every_s=60)):
            await anext(reading)
            task = asyncio.ensure_future(anext(reading))
            await asyncio.sleep(0.05)
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task
        step = asyncio.ensure_future((await session.create(spec)).step(100_000))
        await asyncio.sleep(0.05)
        step.cancel()
        with pytest.raises(asyncio.CancelledError):
            await step

    of_a_session(client, program)


def test_a_stream_that_is_refused_and_written_to(client, spec):
    async def program(_, session):
        cloths = await session.create(spec)
        async with cloths.run(expected=3) as run:
            await asyncio.sleep(0.1)  # refused meanwhile
            await run.pause()
            await run.resume()
            await run.stop()
            await run.pause()
            with pytest.raises(drape.FailedPrecondition, match="STEP_MISMATCH"):
                async for _ in run:
                    pass
            await run.pause()

    of_a_session(client, program)


def test_a_request_of_a_client_that_is_closed_meanwhile(client):
    async def program():
        other = await drape.aio.connect(client.address, retries=None)
        cloths = await (await other.session()).create(sheet(32))
        step = asyncio.ensure_future(cloths.step(100_000, view=None))
        await asyncio.sleep(0.1)
        await other._connection.close()
        with pytest.raises(drape.Error):
            await step

    asyncio.run(asyncio.wait_for(program(), 60))


def test_a_session_that_is_dropped_is_deleted(client):
    async def program(other, _):
        session = await other.session()
        cloths = await session.create(sheet())
        name = session.name
        del session, cloths
        gc.collect()
        for _ in range(500):
            await asyncio.sleep(0.01)
            try:
                await other.session(name=name)
            except drape.SessionLost:
                return True

    assert of_a_session(client, program)


def test_a_session_that_is_dropped_after_its_loop_is_left_to_its_lease(client):
    async def program():
        other = await drape.aio.connect(client.address)
        return await other.session(), other

    kept = list(asyncio.run(program()))
    name = kept[0].name
    del kept[:]
    gc.collect()
    client.session(name=name).close()
    with client.session(name=name) as session:
        assert session.list() == []


def test_a_lost_lease_is_told(client):
    async def program(other, _):
        async with await other.session(ttl_s=1) as session:
            await other._connection.run(_delete(session.name))
            while session.lease_error is None:
                await asyncio.sleep(0.02)
            return session.lease_error

    assert isinstance(of_a_session(client, program), drape.SessionLost)


def _delete(name):
    from drape.operations import Route, Unary

    yield Unary("DeleteSession", drape.v1.DeleteSessionRequest(name=name), Route(name))


def test_a_rollout_that_fails_has_what_came_before(client, spec):
    async def program(_, session):
        cloths = await session.create(spec)
        with pytest.raises(drape.InvalidArgument, match="; 2 of 4 rows came before") as caught:
            await cloths.rollout(4, constraints=[7], rest_lengths=[[[0.2], [0.2], [-1], [0.2]]])
        return caught.value.rows["positions"].shape

    assert of_a_session(client, program) == (1, 2, 36, 3)
